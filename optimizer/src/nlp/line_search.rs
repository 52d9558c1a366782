//! Backtracking filter line search with second-order corrections (WB06 sections 2.3, 2.4).

use super::barrier::{self, DAMPING};
use super::filter::{GAMMA_PHI, GAMMA_THETA, not_above};
use super::formulation::Formulation;
use super::interior_point::{Run, Session, StepRecord};
use super::newton::PrimalDual;

/// Work vectors of the search.
pub(super) struct Search {
    /// The last point tried, its rows and its objective.
    trial: Vec<f64>,
    trial_c: Vec<f64>,
    trial_objective: f64,
    corrected_c: Vec<f64>,
    corrected_rhs: Vec<f64>,
    correction: PrimalDual,
    /// The point before a soft step.
    before: PrimalDual,
    /// Two for each shortened step, one back for each full one: where they alternate, points may alternate, too, each better
    /// than the other by no more than the filter's margin.
    shortened: usize,
    watch: Option<Watch>,
    /// Where the watchdog goes back to.
    watched_point: PrimalDual,
    watched_direction: PrimalDual,
}

/// The watchdog, what it compares with, and the first of its steps.
#[derive(Clone, Copy)]
struct Watch {
    reference: Reference,
    alpha: f64,
    trials: usize,
}

impl Search {
    pub(super) fn new(form: &Formulation) -> Self {
        Self {
            trial: vec![0.0; form.length()],
            trial_c: vec![0.0; form.m],
            trial_objective: f64::NAN,
            corrected_c: vec![0.0; form.m],
            corrected_rhs: vec![0.0; form.m],
            correction: PrimalDual::zeros(form),
            before: PrimalDual::zeros(form),
            shortened: 0,
            watch: None,
            watched_point: PrimalDual::zeros(form),
            watched_direction: PrimalDual::zeros(form),
        }
    }

    /// Drops the watchdog: what it compares with is no longer comparable.
    pub(super) fn end_watch(&mut self) {
        self.watch = None;
        self.shortened = 0;
    }
}

/// What the search compares with.
#[derive(Clone, Copy)]
struct Reference {
    theta: f64,
    phi: f64,
    /// Directional derivative of phi.
    slope: f64,
}

/// A trial point that was accepted.
#[derive(Clone, Copy)]
enum Accepted {
    /// Armijo decrease of phi under the switching condition: the filter stays.
    Objective,
    /// Any other acceptable point: the filter grows.
    Filter,
}

const DELTA: f64 = 1.0;
const S_THETA: f64 = 1.1;
const S_PHI: f64 = 2.3;
const ETA: f64 = 1e-8;
const GAMMA_ALPHA: f64 = 0.05;
const KAPPA_SOC: f64 = 0.99;
/// Decrease asked of a soft step (IPOPT `soft_resto_pderror_reduction_factor`).
const SOFT_REDUCTION: f64 = 0.9999;
/// Largest increase of phi, in powers of ten (IPOPT `obj_max_inc`).
const MAX_PHI_INCREASE: f64 = 5.0;

impl Reference {
    /// m(alpha) < 0 and alpha (-slope)^s_phi > delta theta^s_theta (WB06 eq. 19).
    fn switches(&self, alpha: f64) -> bool {
        self.slope < 0.0 && alpha * (-self.slope).powf(S_PHI) > DELTA * self.theta.powf(S_THETA)
    }

    fn armijo(&self, alpha: f64, phi: f64) -> bool {
        not_above(phi - self.phi, ETA * alpha * self.slope, self.phi)
    }

    /// Smallest step worth trying (WB06 eq. 23).
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

impl Run<'_> {
    /// Searches along the direction and moves the point; false when the step became too small.
    pub(super) fn line_search(&mut self, session: &mut Session, tiny: bool) -> bool {
        let settings = session.settings;
        let tau = barrier::boundary_fraction(settings, self.mu);
        let mut reference = Reference { theta: self.theta(), phi: self.phi(), slope: self.slope() };
        let mut alpha =
            barrier::fraction_to_boundary(&self.at.slack_lower, &self.at.slack_upper, &self.direction.w, tau);
        let mut corrects = true;
        if tiny {
            let (_, _, finite) = self.try_step(alpha, false);
            if finite {
                self.accept(session, alpha, tau, 1);
                return true;
            }
        }
        if settings.watchdog_trigger > 0 && self.search.shortened >= 2 * settings.watchdog_trigger {
            self.search.shortened = 0;
            self.search.watched_point.copy_from(&self.point);
            self.search.watched_direction.copy_from(&self.direction);
            self.search.watch = Some(Watch { reference, alpha, trials: 0 });
        }
        if let Some(mut watch) = self.search.watch.take() {
            let (theta, phi, finite) = self.try_step(alpha, false);
            if finite && let Some(kind) = self.judge(&watch.reference, watch.alpha, theta, phi) {
                self.finish(session, &watch.reference, kind, alpha, tau, 1);
                return true;
            }
            watch.trials += 1;
            if finite && watch.trials <= settings.watchdog_trials {
                self.search.watch = Some(watch);
                self.accept(session, alpha, tau, 1);
                return true;
            }
            // Back to where it began, and an ordinary search there; the matrix of its corrections is gone.
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

    /// After a failed search: the longest step that respects the bounds, if it lowers the primal-dual error of the
    /// barrier problem (the soft restoration phase of IPOPT). Near a solution phi is noise and this is the better judge.
    pub(super) fn soft_step(&mut self, session: &mut Session) -> bool {
        let tau = barrier::boundary_fraction(session.settings, self.mu);
        let before = self.primal_dual_error();
        let alpha = barrier::fraction_to_boundary(&self.at.slack_lower, &self.at.slack_upper, &self.direction.w, tau)
            .min(barrier::fraction_to_zero(&self.point.zl, &self.direction.zl, tau))
            .min(barrier::fraction_to_zero(&self.point.zu, &self.direction.zu, tau));
        let (theta, phi) = (self.theta(), self.phi());
        let (_, _, finite) = self.try_step(alpha, false);
        if !finite {
            return false;
        }
        self.search.before.copy_from(&self.point);
        self.accept(session, alpha, tau, 1);
        if self.is_finite() && self.primal_dual_error() <= SOFT_REDUCTION * before {
            self.filter.add(theta, phi);
            return true;
        }
        self.point.copy_from(&self.search.before);
        self.evaluate();
        false
    }

    /// grad phi^T dw.
    fn slope(&self) -> f64 {
        self.slope_and_size().0
    }

    /// grad phi^T dw, and the sum of its terms' sizes, which says how exact it is.
    pub(super) fn slope_and_size(&self) -> (f64, f64) {
        let (mut slope, mut size) = (0.0, 0.0);
        for j in 0..self.form.length() {
            let barrier = self.mu / self.at.slack_upper[j] - self.mu / self.at.slack_lower[j];
            let damping = DAMPING * self.mu * self.form.single_side(j);
            let term = (self.gradient[j] + barrier + damping) * self.direction.w[j];
            slope += term;
            size += term.abs();
        }
        (slope, size)
    }

    /// Evaluates theta and phi at w + alpha dw (dw: the correction's when `corrected`).
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

    /// Tests a trial point against reference and filter.
    fn judge(&self, reference: &Reference, alpha: f64, theta: f64, phi: f64) -> Option<Accepted> {
        if !self.filter.accepts(theta, phi) {
            return None;
        }
        if phi > reference.phi {
            let base = if reference.phi.abs() > 10.0 { reference.phi.abs().log10() } else { 1.0 };
            if (phi - reference.phi).log10() > MAX_PHI_INCREASE + base {
                return None;
            }
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

    /// Corrections for the curvature of the rows: same matrix, c replaced by alpha c + c(trial) (WB06 section 2.4).
    fn second_order_correction(
        &mut self,
        session: &mut Session,
        reference: &Reference,
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
            if solved.refined > settings.residual_limit {
                return None;
            }
            step = barrier::fraction_to_boundary(
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
        session: &mut Session,
        reference: &Reference,
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

    /// Moves to the point last tried, w + alpha dw, and to y + alpha dy, z + alpha_z dz, and evaluates there what the trial
    /// did not.
    fn accept(&mut self, session: &mut Session, alpha: f64, tau: f64, trials: usize) {
        let alpha_dual = barrier::fraction_to_zero(&self.point.zl, &self.direction.zl, tau)
            .min(barrier::fraction_to_zero(&self.point.zu, &self.direction.zu, tau));
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
        barrier::keep_near_centre(&mut self.point, &self.at, self.mu);
    }
}
