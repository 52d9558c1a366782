//! The primal-dual Newton system and its solution by elimination with one factorisation.
//!
//! ```text
//! (W + delta_w) dw + A^T dy - dz_L + dz_U = r_w
//!        A dw      - delta_c dy           = r_y
//!      Z_L dw      + S_L dz_L             = r_L
//!     -Z_U dw      + S_U dz_U             = r_U
//! ```
//!
//! with S_L = w - l, S_U = u - w. Eliminating the bound multipliers and the row variables leaves the matrix of `kkt`.

mod iterative_refinement;
mod multiplier_estimate;

use std::time::Instant;

use crate::factorisation::{Inertia, KktMatrix, KktSolver, MatrixChange};
use crate::formulation::Formulation;
use crate::primal_dual::{Linearisation, PrimalDual};

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
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
