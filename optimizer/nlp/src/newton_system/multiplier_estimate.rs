//! Estimate of the multipliers of the rows by least squares, at the start of a solve and after restoration.

use super::{NewtonSystem, relative};
use crate::factorisation::MatrixChange;
use crate::formulation::{Formulation, RowForm};
use crate::primal_dual::{PrimalDual, largest};
use crate::settings::NlpSettings;
use std::iter::repeat;
use std::time::Instant;

impl NewtonSystem {
    /// min |grad F + A^T y - z_L + z_U|^2 over y, by the regularised augmented system with H = I (WB06 section 3.6).
    /// The inertia of that matrix is known, so a factorisation with another inertia is distrusted like one with a large
    /// residual. `None` when no method solves the system or the result exceeds the limit of the multipliers.
    pub(crate) fn least_squares_multipliers(
        &mut self,
        form: &Formulation,
        settings: &NlpSettings,
        gradient: &[f64],
        point: &PrimalDual,
        jacobian: &[f64],
    ) -> Option<Vec<f64>> {
        self.diagonal.fill(1.0);
        self.delta_w = 0.0;
        self.delta_c = settings.constants.dual_regularisation_value;
        let b: Vec<f64> = (0..form.length()).map(|j| -(gradient[j] - point.zl[j] + point.zu[j])).collect();
        let zero = vec![0.0; form.m];
        let (mut dw, mut y) = (vec![0.0; form.length()], vec![0.0; form.m]);
        let mut change = MatrixChange::Any;
        loop {
            let inertia = self.factor_with(form, None, jacobian, change)?;
            change = MatrixChange::Diagonal;
            if inertia.negative == form.m && inertia.zero == 0 {
                let clock = Instant::now();
                self.reduced_solve(form, &b, &zero, &mut dw, &mut y);
                let residual = self.least_squares_residual(form, jacobian, &b, &dw, &y);
                self.tally.solve_seconds += clock.elapsed().as_secs_f64();
                if residual <= settings.constants.residual_limit {
                    return (largest(&y) <= settings.constants.multiplier_limit).then_some(y);
                }
            }
            if !self.solver.reject_factorisation() {
                return None;
            }
        }
    }

    /// Relative residual of dw + A^T y = b, A dw - delta_c y = 0, measured as that of the full system.
    fn least_squares_residual(
        &mut self,
        form: &Formulation,
        jacobian: &[f64],
        b: &[f64],
        dw: &[f64],
        y: &[f64],
    ) -> f64 {
        let r = &mut self.residual;
        r.w.copy_from_slice(dw);
        r.y.fill(0.0);
        form.add_both_products(jacobian, y, &mut r.w, dw, &mut r.y);
        // Fixed variables do not move, whatever their gradient.
        let mut size: f64 = 0.0;
        for ((r, b), fixed) in r.w.iter_mut().zip(b).zip(form.fixed.iter().map(Option::is_some).chain(repeat(false))) {
            *r = if fixed { 0.0 } else { b - *r };
            size = size.max(if fixed { 0.0 } else { b.abs() });
        }
        for (i, r) in r.y.iter_mut().enumerate() {
            let delta_c = if self.unregularised[form.n + i] { 0.0 } else { self.delta_c };
            *r = if form.rows[i] == RowForm::Free { 0.0 } else { *r - delta_c * y[i] };
        }
        let error = largest(&r.w).max(largest(&r.y));
        let length = largest(dw).max(largest(y));
        relative(error, size, length)
    }
}
