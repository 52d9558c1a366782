//! Backtracking filter line search with second-order corrections (WB06 sections 2.3, 2.4).

use crate::barrier;
use crate::fraction_to_boundary;
use crate::iterate::{Iterate, SolveSession, StepRecord};
use crate::line_search_filter::{GAMMA_PHI, GAMMA_THETA, not_above};
use crate::line_search_state::{MeritReference, Watchdog};

/// Type of an accepted trial point.
#[derive(Clone, Copy)]
enum Accepted {
    /// Switching condition and Armijo decrease of phi hold: the filter is not augmented.
    Objective,
    /// Any other acceptable point: the filter is augmented.
    Filter,
}

const DELTA: f64 = 1.0;
const S_THETA: f64 = 1.1;
const S_PHI: f64 = 2.3;
const ETA: f64 = 1e-8;
const GAMMA_ALPHA: f64 = 0.05;
const KAPPA_SOC: f64 = 0.99;

impl MeritReference {
    /// m(alpha) < 0 and alpha (-slope)^s_phi > delta theta^s_theta (WB06 eq. 19).
    fn switches(&self, alpha: f64) -> bool {
        self.slope < 0.0 && alpha * (-self.slope).powf(S_PHI) > DELTA * self.theta.powf(S_THETA)
    }

    fn armijo(&self, alpha: f64, phi: f64) -> bool {
        not_above(phi - self.phi, ETA * alpha * self.slope, self.phi)
    }

    /// Smallest step before the restoration phase (WB06 eq. 23).
    fn smallest_step(&self, theta_min: f64) -> f64 {
        let mut alpha = GAMMA_THETA;
        if self.slope < 0.0 {
            alpha = alpha.min(GAMMA_PHI * self.theta / -self.slope);
            if self.theta <= theta_min {
                alpha = alpha.min(DELTA * self.theta.powf(S_THETA) / (-self.slope).powf(S_PHI));
            }
        }
        GAMMA_ALPHA * alpha
    }
}

impl Iterate<'_> {
    /// Searches along the direction and moves to the accepted point; false when the step becomes too small.
    pub(crate) fn line_search(&mut self, session: &mut SolveSession) -> bool {
        let settings = session.settings;
        let tau = fraction_to_boundary::boundary_fraction(settings, self.mu);
        let mut reference = MeritReference { theta: self.theta(), phi: self.phi(), slope: self.slope() };
        let mut alpha =
            fraction_to_boundary::of_slacks(&self.at.slack_lower, &self.at.slack_upper, &self.direction.w, tau);
        let mut corrects = true;
        if settings.constants.watchdog_trigger > 0 && self.search.shortened >= 2 * settings.constants.watchdog_trigger {
            self.search.shortened = 0;
            self.search.watched_point.copy_from(&self.point);
            self.search.watched_direction.copy_from(&self.direction);
            self.search.watch = Some(Watchdog { reference, alpha, trials: 0 });
        }
        if let Some(mut watch) = self.search.watch.take() {
            let (theta, phi, finite) = self.try_step(alpha, false);
            if finite && let Some(kind) = self.judge(&watch.reference, watch.alpha, theta, phi) {
                self.finish(session, &watch.reference, kind, alpha, tau, 1);
                return true;
            }
            watch.trials += 1;
            if finite && watch.trials <= settings.constants.watchdog_trials {
                self.search.watch = Some(watch);
                self.accept(session, alpha, tau, 1);
                return true;
            }
            // Ordinary search from the point where the watchdog began. Its matrix is gone, so there are no corrections.
            self.point.copy_from(&self.search.watched_point);
            self.direction.copy_from(&self.search.watched_direction);
            self.evaluate();
            (reference, alpha, corrects) = (watch.reference, watch.alpha, false);
        }
        let smallest = reference.smallest_step(self.theta_min);
        let mut trials = 0;
        while alpha > smallest || trials == 0 {
            trials += 1;
            let (theta, phi, finite) = self.try_step(alpha, false);
            if finite {
                if let Some(kind) = self.judge(&reference, alpha, theta, phi) {
                    self.search.shortened =
                        if trials > 1 { self.search.shortened + 2 } else { self.search.shortened.saturating_sub(1) };
                    self.correction.observe(settings, trials);
                    self.finish(session, &reference, kind, alpha, tau, trials);
                    return true;
                }
                if trials == 1
                    && corrects
                    && theta >= reference.theta
                    && let Some((kind, alpha, extra)) =
                        self.second_order_correction(session, &reference, alpha, tau, theta)
                {
                    self.search.shortened = self.search.shortened.saturating_sub(1);
                    self.correction.observe(settings, 1);
                    self.finish(session, &reference, kind, alpha, tau, trials + extra);
                    return true;
                }
            }
            alpha *= 0.5;
        }
        false
    }

    /// grad phi^T dw.
    fn slope(&self) -> f64 {
        let of = |j: usize| {
            let barrier = self.mu / self.at.slack_upper[j] - self.mu / self.at.slack_lower[j];
            let damping = self.form.constants.damping * self.mu * self.form.single_side(j);
            (self.gradient[j] + barrier + damping) * self.direction.w[j]
        };
        (0..self.form.length()).map(of).sum()
    }

    /// Evaluates theta and phi at w + alpha dw, with dw of the second-order correction if `corrected`.
    fn try_step(&mut self, alpha: f64, corrected: bool) -> (f64, f64, bool) {
        let direction = if corrected { &self.search.correction.w } else { &self.direction.w };
        for ((t, w), d) in self.search.trial.iter_mut().zip(&self.point.w).zip(direction) {
            *t = w + alpha * d;
        }
        self.form.constraints(&self.search.trial, &mut self.search.trial_c);
        let theta: f64 = self.search.trial_c.iter().map(|c| c.abs()).sum();
        if !theta.is_finite() {
            return (theta, f64::NAN, false);
        }
        self.search.trial_objective = self.form.objective(&self.search.trial);
        let phi = self.search.trial_objective + barrier::barrier_term(&self.form, &self.search.trial, self.mu);
        (theta, phi, phi.is_finite())
    }

    /// Tests a trial point against the reference and the filter.
    fn judge(&self, reference: &MeritReference, alpha: f64, theta: f64, phi: f64) -> Option<Accepted> {
        if !self.filter.accepts(theta, phi) {
            return None;
        }
        if reference.theta <= self.theta_min && reference.switches(alpha) {
            return reference.armijo(alpha, phi).then_some(Accepted::Objective);
        }
        let less_violation = not_above(theta, (1.0 - GAMMA_THETA) * reference.theta, reference.theta);
        let less_objective = not_above(phi - reference.phi, -GAMMA_PHI * reference.theta, reference.phi);
        (less_violation || less_objective).then_some(if reference.switches(alpha) && reference.armijo(alpha, phi) {
            Accepted::Objective
        } else {
            Accepted::Filter
        })
    }

    /// Second-order corrections: the same matrix, with c replaced by alpha c + c(trial) (WB06 section 2.4).
    fn second_order_correction(
        &mut self,
        session: &mut SolveSession,
        reference: &MeritReference,
        alpha: f64,
        tau: f64,
        first_theta: f64,
    ) -> Option<(Accepted, f64, usize)> {
        let settings = session.settings;
        let mut previous = first_theta;
        let mut step = alpha;
        self.search.corrected_c.copy_from_slice(&self.c);
        for count in 1..=settings.max_second_order_corrections {
            for (s, t) in self.search.corrected_c.iter_mut().zip(&self.search.trial_c) {
                *s = step * *s + t;
            }
            for (rhs, c) in self.search.corrected_rhs.iter_mut().zip(&self.search.corrected_c) {
                *rhs = -c;
            }
            std::mem::swap(&mut self.rhs.y, &mut self.search.corrected_rhs);
            let solved = session.newton.solve(
                &self.form,
                settings,
                &self.point,
                &self.at,
                &self.rhs,
                &mut self.search.correction,
            );
            std::mem::swap(&mut self.rhs.y, &mut self.search.corrected_rhs);
            if solved.refined > settings.constants.residual_limit {
                return None;
            }
            step = fraction_to_boundary::of_slacks(
                &self.at.slack_lower,
                &self.at.slack_upper,
                &self.search.correction.w,
                tau,
            );
            let (theta, phi, finite) = self.try_step(step, true);
            if !finite {
                return None;
            }
            if let Some(kind) = self.judge(reference, alpha, theta, phi) {
                std::mem::swap(&mut self.direction, &mut self.search.correction);
                return Some((kind, step, count));
            }
            if theta > KAPPA_SOC * previous {
                return None;
            }
            previous = theta;
        }
        None
    }

    fn finish(
        &mut self,
        session: &mut SolveSession,
        reference: &MeritReference,
        kind: Accepted,
        alpha: f64,
        tau: f64,
        trials: usize,
    ) {
        if matches!(kind, Accepted::Filter) {
            self.filter.add(reference.theta, reference.phi);
        }
        self.accept(session, alpha, tau, trials);
    }

    /// Moves to the last trial point w + alpha dw and to y + alpha dy, z + alpha_z dz, and evaluates the derivatives
    /// there.
    fn accept(&mut self, session: &mut SolveSession, alpha: f64, tau: f64, trials: usize) {
        let alpha_dual = fraction_to_boundary::of_multipliers(&self.point.zl, &self.direction.zl, tau)
            .min(fraction_to_boundary::of_multipliers(&self.point.zu, &self.direction.zu, tau));
        let add = |a: &mut [f64], d: &[f64], alpha: f64| {
            for (a, d) in a.iter_mut().zip(d) {
                *a += alpha * d;
            }
        };
        self.point.w.copy_from_slice(&self.search.trial);
        add(&mut self.point.y, &self.direction.y, alpha);
        add(&mut self.point.zl, &self.direction.zl, alpha_dual);
        add(&mut self.point.zu, &self.direction.zu, alpha_dual);
        session.last_step = StepRecord {
            alpha_primal: alpha,
            alpha_dual,
            delta_w: self.correction.delta_w,
            delta_c: self.correction.delta_c,
            trials,
        };
        self.c.copy_from_slice(&self.search.trial_c);
        self.objective = self.search.trial_objective;
        self.measure_slacks();
        self.linearise();
        barrier::keep_near_centre(&mut self.point, &self.at, self.mu, session.settings.constants.kappa_sigma);
    }
}
