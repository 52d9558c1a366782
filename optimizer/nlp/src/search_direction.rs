//! The search direction: Newton steps with inertia correction, and least-squares multipliers.

use crate::factorisation::MatrixChange;
use crate::iterate::{Iterate, SolveSession};
use crate::status::NlpPhase;

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
                        && session.newton.reject_factorisation();
                    let solves = !distrusts && solved.refined <= settings.constants.residual_limit;
                    if solves {
                        self.correction.accept(settings);
                        return true;
                    }
                    distrusts || self.correction.increase(settings)
                }
                _ => self.correction.increase(settings),
            };
            if !go_on {
                return false;
            }
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
