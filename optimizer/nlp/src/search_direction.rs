//! The search direction: Newton steps with inertia correction, and least-squares multipliers.

use crate::factorisation::MatrixChange;
use crate::iterate::{Iterate, SolveSession};
use crate::newton_system::NewtonSystem;
use crate::status::NlpPhase;

/// Fraction of an ascent that the rows may explain (see [`Iterate::curves_downwards`]).
const ROWS_SHARE: f64 = 0.1;
/// Regularisation that stands in for that of unregularised rows there.
const LITTLE_REGULARISATION: f64 = 1e-9;
/// An ascent below this fraction of the sum of the magnitudes of its terms is a rounding error.
const CANCELLATION: f64 = 1e-8;

impl Iterate<'_> {
    /// Computes the Newton direction with inertia correction; false when no regularisation gives one.
    pub(crate) fn compute_direction(&mut self, session: &mut SolveSession) -> bool {
        let settings = session.settings;
        if !self.rows_curve {
            self.rows_curve =
                self.phase() == NlpPhase::Restoration || self.largest_violation() <= settings.curvature_from_violation;
        }
        let multipliers = self.rows_curve.then_some(self.point.y.as_slice());
        self.form.hessian(&self.point.w, multipliers, &mut self.at.hessian);
        for j in 0..self.form.length() {
            let (sl, su) = (self.at.slack_lower[j], self.at.slack_upper[j]);
            self.rhs.w[j] = -(self.lagrangian[j] + settings.constants.damping * self.mu * self.form.single_side(j));
            self.rhs.zl[j] = if sl.is_finite() { self.mu - sl * self.point.zl[j] } else { 0.0 };
            self.rhs.zu[j] = if su.is_finite() { self.mu - su * self.point.zu[j] } else { 0.0 };
        }
        for (r, c) in self.rhs.y.iter_mut().zip(&self.c) {
            *r = -c;
        }
        self.correction.begin(settings, self.mu);
        let mut change = MatrixChange::Any;
        let mut refusals = 0;
        loop {
            let (dw, dc) = (self.correction.delta_w, self.correction.delta_c);
            let inertia = session.newton.factor(&self.form, &self.point, &self.at, (dw, dc), change);
            if inertia.is_some() {
                change = MatrixChange::Diagonal;
            }
            let go_on = match inertia {
                Some(i) if i.zero == 0 && i.negative == self.form.m => {
                    let solved = session.newton.solve(
                        &self.form,
                        settings,
                        &self.point,
                        &self.at,
                        &self.rhs,
                        &mut self.direction,
                    );
                    let distrusts = settings.constants.distrusts_unrefined
                        && solved.unrefined > settings.constants.residual_limit
                        && session.newton.distrust();
                    let solves = !distrusts && solved.refined <= settings.constants.residual_limit;
                    if solves && settings.constants.checks_curvature && self.curves_downwards(&session.newton) {
                        session.newton.distrust() || self.correction.increase(settings)
                    } else if solves {
                        self.correction.accept(settings);
                        return true;
                    } else {
                        distrusts || self.correction.increase(settings)
                    }
                }
                Some(i) if i.zero == 0 && i.negative > self.form.m => {
                    // Element growth that spoils solutions spoils the inertia as well, and regularisation would only
                    // hide it.
                    refusals += 1;
                    let distrusts = refusals == settings.constants.doubted_refusal
                        && session.newton.unrefined_residual(
                            &self.form,
                            &self.point,
                            &self.at,
                            &self.rhs,
                            &mut self.direction,
                        ) > settings.constants.residual_limit
                        && session.newton.distrust();
                    distrusts || self.correction.increase(settings)
                }
                _ => self.correction.increase(settings),
            };
            if !go_on {
                return false;
            }
        }
    }

    /// Whether the direction d shows that the inertia is wrong. With the right inertia and regularised rows the
    /// matrix K + A^T A / `delta_c` with K = W + Sigma + `delta_w` I is positive definite. From A d = `delta_c` dy -
    /// c and d^T K d = (c - `delta_c` dy)^T (y + dy) - grad phi^T d follows that its quadratic form along d is the
    /// sum over the rows below minus the slope. For rows without regularisation A d = -c, and K only has to be
    /// positive definite in their null space; they get a small regularisation, so that their violation explains any
    /// curvature.
    fn curves_downwards(&self, newton: &NewtonSystem) -> bool {
        let (slope, size) = self.slope_and_size();
        slope > CANCELLATION * size && {
            let of_row = |i: usize| {
                let (c, y, dy) = (self.c[i], self.point.y[i], self.direction.y[i]);
                let delta_c = newton.row_regularisation(&self.form, i);
                if delta_c > 0.0 {
                    c * (y - dy) - delta_c * dy * y + c * c / delta_c
                } else {
                    c * (y + dy) + c * c / LITTLE_REGULARISATION
                }
            };
            (0..self.form.m).map(of_row).sum::<f64>() < ROWS_SHARE * slope
        }
    }

    /// Resets filter and multipliers: z = mu / slack, y by least squares.
    pub(crate) fn recentre(&mut self, session: &mut SolveSession) {
        self.filter.clear();
        self.search.end_watch();
        for j in 0..self.form.length() {
            self.point.zl[j] = if self.at.slack_lower[j].is_finite() { self.mu / self.at.slack_lower[j] } else { 0.0 };
            self.point.zu[j] = if self.at.slack_upper[j].is_finite() { self.mu / self.at.slack_upper[j] } else { 0.0 };
        }
        self.estimate_multipliers(session);
    }

    /// Least-squares row multipliers at the point; zero when they are too large or cannot be computed (WB06 section
    /// 3.6).
    pub(crate) fn estimate_multipliers(&mut self, session: &mut SolveSession) {
        session.newton.fit(&self.form);
        let y = session.newton.least_squares_multipliers(
            &self.form,
            session.settings,
            &self.gradient,
            &self.point,
            &self.at.jacobian,
        );
        match y {
            Some(y) => self.point.y = y,
            None => self.point.y.fill(0.0),
        }
    }
}
