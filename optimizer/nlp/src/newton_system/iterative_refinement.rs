//! Iterative refinement of the solution of the Newton system.
//!
//! The residual is always that of the full system, which is not scaled by the eliminated slacks (WB06 section 3.10).

use std::time::Instant;

use super::{NewtonSystem, Solved, relative};
use crate::formulation::{Formulation, RowForm};
use crate::primal_dual::{Linearisation, PrimalDual};
use crate::settings::NlpSettings;

impl NewtonSystem {
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
