//! The primal-dual Newton system and its solution with iterative refinement.
//!
//! ```text
//! (W + delta_w) dw + A^T dy - dz_L + dz_U = r_w
//!        A dw      - delta_c dy           = r_y
//!      Z_L dw      + S_L dz_L             = r_L
//!     -Z_U dw      + S_U dz_U             = r_U
//! ```
//!
//! with S_L = w - l, S_U = u - w. Eliminating the bound multipliers and the row variables leaves the matrix of `kkt`.
//! The residual is always that of the full system above, which is not scaled by the eliminated slacks (WB06 section
//! 3.10).

mod multiplier_estimate;

use std::time::Instant;

use crate::factorisation::{Inertia, KktMatrix, KktSolver, MatrixChange};
use crate::formulation::{Formulation, RowForm};
use crate::primal_dual::{Linearisation, PrimalDual};
use crate::settings::NlpSettings;

/// |r| / (|rhs| + min(|d|, 1e6 |rhs|)); infinite when the solution d is not finite.
fn relative(residual: f64, size: f64, length: f64) -> f64 {
    let scale = size + length.min(1e6 * size);
    if !length.is_finite() {
        f64::INFINITY
    } else if scale > 0.0 {
        residual / scale
    } else {
        0.0
    }
}

/// Relative residuals of a solution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solved {
    /// Before refinement.
    pub unrefined: f64,
    pub refined: f64,
}

/// Times and counts of the linear algebra.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LinearTally {
    /// Assembly and factorisation.
    pub factor_seconds: f64,
    /// Substitutions, residuals and refinement.
    pub solve_seconds: f64,
    pub factorisations: usize,
    pub backsolves: usize,
}

/// KKT matrix, factorisation and workspace.
pub(crate) struct NewtonSystem {
    matrix: KktMatrix,
    solver: Box<dyn KktSolver>,
    /// Diagonal of the w block: Sigma + curvature + delta_w.
    diagonal: Vec<f64>,
    delta_w: f64,
    delta_c: f64,
    /// Indices whose regularisation the factorisation neglected.
    unregularised: Vec<bool>,
    rhs: Vec<f64>,
    residual: PrimalDual,
    correction: PrimalDual,
    pub tally: LinearTally,
}

impl NewtonSystem {
    pub(crate) fn new(matrix: KktMatrix, solver: Box<dyn KktSolver>) -> Self {
        let rhs = vec![0.0; matrix.order];
        Self {
            matrix,
            solver,
            diagonal: Vec::new(),
            delta_w: 0.0,
            delta_c: 0.0,
            unregularised: vec![false; rhs.len()],
            rhs,
            residual: PrimalDual::default(),
            correction: PrimalDual::default(),
            tally: LinearTally::default(),
        }
    }

    pub(crate) fn factor_entries(&self) -> usize {
        self.solver.factor_entries()
    }

    pub(crate) fn solver_fallbacks(&self) -> usize {
        self.solver.fallbacks()
    }

    /// See [`KktSolver::reject_factorisation`].
    pub(crate) fn reject_factorisation(&mut self) -> bool {
        self.solver.reject_factorisation()
    }

    /// Resizes the work vectors for a formulation; that of the restoration phase is longer.
    pub(crate) fn fit(&mut self, form: &Formulation) {
        self.diagonal = vec![0.0; form.length()];
        self.residual = PrimalDual::zeros(form);
        self.correction = PrimalDual::zeros(form);
    }

    /// Factorises the Newton matrix with the given regularisation.
    pub(crate) fn factor(
        &mut self,
        form: &Formulation,
        point: &PrimalDual,
        at: &Linearisation,
        (delta_w, delta_c): (f64, f64),
        change: MatrixChange,
    ) -> Option<Inertia> {
        let lower = point.zl.iter().zip(&at.slack_lower);
        let upper = point.zu.iter().zip(&at.slack_upper);
        for ((d, (zl, sl)), (zu, su)) in self.diagonal.iter_mut().zip(lower).zip(upper) {
            *d = zl / sl + zu / su + delta_w;
        }
        form.add_curvature(&mut self.diagonal);
        self.delta_w = delta_w;
        self.delta_c = delta_c;
        self.factor_with(form, Some(&at.hessian), &at.jacobian, change)
    }

    fn factor_with(
        &mut self,
        form: &Formulation,
        hessian: Option<&[f64]>,
        jacobian: &[f64],
        change: MatrixChange,
    ) -> Option<Inertia> {
        let clock = Instant::now();
        if change == MatrixChange::Any {
            self.matrix.assemble(hessian, jacobian);
        }
        let finite = self.matrix.set_diagonal(form, &self.diagonal, self.delta_c);
        let inertia = if finite { self.solver.factor(&self.matrix.values, change) } else { None };
        self.unregularised.fill(false);
        self.solver.mark_neglected(&mut self.unregularised);
        self.tally.factor_seconds += clock.elapsed().as_secs_f64();
        self.tally.factorisations += 1;
        inertia
    }

    /// Solves (W + d) dw + A^T dy = b, A dw - delta_c dy = c with the last factorisation.
    fn reduced_solve(&mut self, form: &Formulation, b: &[f64], c: &[f64], dw: &mut [f64], dy: &mut [f64]) {
        let n = form.n;
        for j in 0..n {
            self.rhs[j] = if form.fixed[j].is_some() { 0.0 } else { b[j] };
        }
        self.rhs[n..].copy_from_slice(c);
        for (k, a) in form.row_variables.iter().enumerate() {
            self.rhs[n + a.row] -= a.sign * b[n + k] / self.diagonal[n + k];
        }
        self.solver.solve(&mut self.rhs);
        dw[..n].copy_from_slice(&self.rhs[..n]);
        dy.copy_from_slice(&self.rhs[n..]);
        for (k, a) in form.row_variables.iter().enumerate() {
            dw[n + k] = (b[n + k] - a.sign * dy[a.row]) / self.diagonal[n + k];
        }
        self.tally.backsolves += 1;
    }

    /// Solves the full system by elimination with the last factorisation.
    fn full_solve(
        &mut self,
        form: &Formulation,
        point: &PrimalDual,
        at: &Linearisation,
        rhs: &PrimalDual,
        out: &mut PrimalDual,
    ) {
        // out.zl is the workspace of the eliminated right-hand side.
        let mut b = std::mem::take(&mut out.zl);
        let lower = rhs.zl.iter().zip(&at.slack_lower);
        let upper = rhs.zu.iter().zip(&at.slack_upper);
        for (((b, w), (rl, sl)), (ru, su)) in b.iter_mut().zip(&rhs.w).zip(lower).zip(upper) {
            *b = w + rl / sl - ru / su;
        }
        self.reduced_solve(form, &b, &rhs.y, &mut out.w, &mut out.y);
        out.zl = b;
        let lower = rhs.zl.iter().zip(&point.zl).zip(&at.slack_lower);
        for ((out, dw), ((r, z), s)) in out.zl.iter_mut().zip(&out.w).zip(lower) {
            *out = (r - z * dw) / s;
        }
        let upper = rhs.zu.iter().zip(&point.zu).zip(&at.slack_upper);
        for ((out, dw), ((r, z), s)) in out.zu.iter_mut().zip(&out.w).zip(upper) {
            *out = (r + z * dw) / s;
        }
    }

    /// rhs - (matrix)(direction) of the full system, into `self.residual`.
    fn full_residual(
        &mut self,
        form: &Formulation,
        point: &PrimalDual,
        at: &Linearisation,
        rhs: &PrimalDual,
        d: &PrimalDual,
    ) {
        let r = &mut self.residual;
        r.w.fill(0.0);
        r.y.fill(0.0);
        form.add_hessian_product(&at.hessian, &d.w, &mut r.w);
        form.add_both_products(&at.jacobian, &d.y, &mut r.w, &d.w, &mut r.y);
        form.add_curvature_product(&d.w, &mut r.w);
        let bounds = d.zl.iter().zip(&d.zu);
        for (((r, rhs), dw), (dzl, dzu)) in r.w.iter_mut().zip(&rhs.w).zip(&d.w).zip(bounds) {
            *r = rhs - (*r + self.delta_w * dw - dzl + dzu);
        }
        for (r, _) in r.w.iter_mut().zip(&form.fixed).filter(|(_, fixed)| fixed.is_some()) {
            *r = 0.0;
        }
        // Without a bound all terms are zero except the slack, which is infinite.
        let finite = |slack: f64| if slack < f64::INFINITY { slack } else { 0.0 };
        let lower = point.zl.iter().zip(&at.slack_lower);
        for ((((r, rhs), dw), dz), (z, s)) in r.zl.iter_mut().zip(&rhs.zl).zip(&d.w).zip(&d.zl).zip(lower) {
            *r = rhs - (z * dw + finite(*s) * dz);
        }
        let upper = point.zu.iter().zip(&at.slack_upper);
        for ((((r, rhs), dw), dz), (z, s)) in r.zu.iter_mut().zip(&rhs.zu).zip(&d.w).zip(&d.zu).zip(upper) {
            *r = rhs - (finite(*s) * dz - z * dw);
        }
        for i in 0..form.m {
            r.y[i] = if form.rows[i] == RowForm::Free {
                0.0
            } else {
                let delta_c = if self.unregularised[form.n + i] { 0.0 } else { self.delta_c };
                rhs.y[i] - (r.y[i] - delta_c * d.y[i])
            };
        }
    }

    /// Solves the full system without refinement. Returns the relative residual |r| / (|rhs| + min(|d|, 1e6 |rhs|)),
    /// a measure of the accuracy of the factorisation; infinite when the solution is not finite.
    pub(crate) fn unrefined_residual(
        &mut self,
        form: &Formulation,
        point: &PrimalDual,
        at: &Linearisation,
        rhs: &PrimalDual,
        out: &mut PrimalDual,
    ) -> f64 {
        let clock = Instant::now();
        self.full_solve(form, point, at, rhs, out);
        let residual = self.relative_residual(form, point, at, rhs, out);
        self.tally.solve_seconds += clock.elapsed().as_secs_f64();
        residual
    }

    /// Relative residual of a solution; the residual itself is in `self.residual` afterwards.
    fn relative_residual(
        &mut self,
        form: &Formulation,
        point: &PrimalDual,
        at: &Linearisation,
        rhs: &PrimalDual,
        out: &PrimalDual,
    ) -> f64 {
        self.full_residual(form, point, at, rhs, out);
        relative(self.residual.largest(), rhs.largest(), out.largest())
    }

    /// Solves the full system with iterative refinement; returns the relative residuals.
    pub(crate) fn solve(
        &mut self,
        form: &Formulation,
        settings: &NlpSettings,
        point: &PrimalDual,
        at: &Linearisation,
        rhs: &PrimalDual,
        out: &mut PrimalDual,
    ) -> Solved {
        let unrefined = self.unrefined_residual(form, point, at, rhs, out);
        let clock = Instant::now();
        let refined = self.refine(form, settings, point, at, rhs, out, unrefined);
        self.tally.solve_seconds += clock.elapsed().as_secs_f64();
        Solved { unrefined, refined }
    }

    /// Refines a solution whose residual is in `self.residual`; returns its relative residual.
    #[allow(clippy::too_many_arguments)] // the system, its right-hand side, its solution
    fn refine(
        &mut self,
        form: &Formulation,
        settings: &NlpSettings,
        point: &PrimalDual,
        at: &Linearisation,
        rhs: &PrimalDual,
        out: &mut PrimalDual,
        unrefined: f64,
    ) -> f64 {
        let (mut best, mut ratio) = (f64::INFINITY, unrefined);
        let mut refinements = 0;
        loop {
            if ratio >= best && refinements > 0 {
                // The last correction did not reduce the residual: undo it.
                for (a, b) in out.parts_mut().into_iter().zip(self.correction.parts()) {
                    for (x, y) in a.iter_mut().zip(b) {
                        *x -= y;
                    }
                }
                return best;
            }
            let stagnates = refinements > 0 && ratio > 0.5 * best;
            best = ratio;
            if ratio <= settings.constants.residual_target || !ratio.is_finite() || stagnates {
                return best;
            }
            if refinements == settings.constants.max_refinements {
                return best;
            }
            let residual = std::mem::take(&mut self.residual);
            let mut correction = std::mem::take(&mut self.correction);
            self.full_solve(form, point, at, &residual, &mut correction);
            self.residual = residual;
            self.correction = correction;
            out.add(&self.correction);
            refinements += 1;
            ratio = self.relative_residual(form, point, at, rhs, out);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
