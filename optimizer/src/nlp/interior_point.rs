//! The interior-point iteration on one formulation (WB06 algorithm A), used for the problem itself and, with elastics,
//! for its restoration phase.

use std::time::Instant;

use super::barrier::{self, DAMPING};
use super::factorisation::Change;
use super::filter::Filter;
use super::formulation::{Formulation, Objective, RowKind};
use super::inertia_correction::InertiaCorrection;
use super::line_search::Search;
use super::newton::{Linearisation, NewtonSystem, PrimalDual, largest};
use super::optimality::Optimality;
use super::restoration;
use super::settings::{BarrierStrategy, NlpSettings};
use super::status::{Counts, NlpIteration, Phase};

/// What all runs of one solve share.
pub(super) struct Session<'a> {
    pub settings: &'a NlpSettings,
    pub observer: &'a mut dyn FnMut(&NlpIteration),
    pub cancel: &'a dyn Fn() -> bool,
    pub started: Instant,
    pub newton: NewtonSystem,
    pub iterations: usize,
    pub counts: Counts,
    pub last_step: StepRecord,
}

/// The step that led to an iterate.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StepRecord {
    pub alpha_primal: f64,
    pub alpha_dual: f64,
    pub delta_w: f64,
    pub delta_c: f64,
    pub trials: usize,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ending {
    Converged,
    /// The restoration phase reached a point the caller accepts.
    Left,
    Infeasible,
    Stalled,
    Unbounded,
    IterationLimit,
    TimeLimit,
    Cancelled,
}

/// Iterate, derivatives and globalisation state on one formulation.
pub(super) struct Run<'p> {
    pub form: Formulation<'p>,
    pub point: PrimalDual,
    pub at: Linearisation,
    pub objective: f64,
    pub c: Vec<f64>,
    pub gradient: Vec<f64>,
    /// grad F + A^T y - z_L + z_U.
    pub lagrangian: Vec<f64>,
    pub mu: f64,
    pub filter: Filter,
    pub theta_min: f64,
    pub correction: InertiaCorrection,
    pub direction: PrimalDual,
    pub rhs: PrimalDual,
    pub search: Search,
    free_mu: FreeMu,
    /// Work vector: the rows without the elastics.
    own_rows: Vec<f64>,
    /// Whether the violation has been small enough for the rows' curvature (`NlpSettings::curvature_from_violation`).
    rows_curve: bool,
}

/// Memory of the adaptive barrier strategy.
#[derive(Debug, Clone, Default)]
struct FreeMu {
    /// Following the free rule at the moment (else monotone).
    free: bool,
    /// The last optimality errors.
    recent: Vec<f64>,
}

fn unscaled_violation(c: &[f64], scale: &[f64]) -> f64 {
    c.iter().zip(scale).fold(0.0, |v: f64, (c, s)| if c.is_nan() { f64::INFINITY } else { v.max(c.abs() / s) })
}

/// Whether a restoration phase may end at this w.
pub(super) type Leave<'f> = &'f mut dyn FnMut(&[f64]) -> bool;

/// The refusal in one iteration at which the factorisation is asked whether its count of eigenvalues can be trusted: most
/// iterations with a refusal have one, and a wrong one costs no more than a regularisation that was not needed.
const DOUBTED_REFUSAL: usize = 2;
/// Share of an ascent that the rows may account for before it is theirs (see [`Run::curves_downwards`]).
const ROWS_SHARE: f64 = 0.1;
/// What rows without a regularisation count as having there.
const LITTLE_REGULARISATION: f64 = 1e-9;
/// Share of the sum of its terms' sizes below which an ascent is rounding.
const CANCELLATION: f64 = 1e-8;
/// Primal steps below this are short (see `NlpSettings::short_step_limit`).
const SHORT_STEP: f64 = 0.05;

impl<'p> Run<'p> {
    /// Takes a point strictly inside its bounds; evaluates nothing yet.
    pub(super) fn new(form: Formulation<'p>, point: PrimalDual, mu: f64) -> Self {
        let length = form.length();
        let at = Linearisation {
            jacobian: vec![0.0; form.program.jacobian_pattern().row_indices.len()],
            hessian: vec![0.0; form.program.hessian_pattern().row_indices.len()],
            slack_lower: vec![f64::INFINITY; length],
            slack_upper: vec![f64::INFINITY; length],
        };
        Self {
            at,
            objective: 0.0,
            c: vec![0.0; form.m],
            own_rows: vec![0.0; form.m],
            gradient: vec![0.0; length],
            lagrangian: vec![0.0; length],
            mu,
            filter: Filter::default(),
            theta_min: 0.0,
            correction: InertiaCorrection::default(),
            direction: PrimalDual::zeros(&form),
            rhs: PrimalDual::zeros(&form),
            search: Search::new(&form),
            free_mu: FreeMu { free: true, recent: Vec::new() },
            rows_curve: false,
            point,
            form,
        }
    }

    /// Slacks of the bounds at the point. A slack lost to rounding moves its bound (WB06 section 3.5).
    pub(super) fn measure_slacks(&mut self) {
        let smallest = f64::EPSILON * self.mu.min(1.0);
        let movement = f64::EPSILON.powf(0.75);
        for j in 0..self.form.length() {
            let (l, u, w) = (self.form.lower[j], self.form.upper[j], self.point.w[j]);
            if l.is_finite() {
                self.at.slack_lower[j] = w - l;
                if w - l < smallest {
                    let slack = (self.mu / self.point.zl[j]).max(smallest).min(movement * l.abs().max(1.0));
                    self.form.lower[j] = w - slack;
                    self.at.slack_lower[j] = (w - self.form.lower[j]).max(f64::MIN_POSITIVE);
                }
            }
            if u.is_finite() {
                self.at.slack_upper[j] = u - w;
                if u - w < smallest {
                    let slack = (self.mu / self.point.zu[j]).max(smallest).min(movement * u.abs().max(1.0));
                    self.form.upper[j] = w + slack;
                    self.at.slack_upper[j] = (self.form.upper[j] - w).max(f64::MIN_POSITIVE);
                }
            }
        }
    }

    /// Evaluates everything of first order at the point.
    pub(super) fn evaluate(&mut self) {
        self.measure_slacks();
        self.objective = self.form.objective(&self.point.w);
        self.form.constraints(&self.point.w, &mut self.c);
        self.linearise();
    }

    /// Evaluates the first derivatives at the point.
    pub(super) fn linearise(&mut self) {
        self.form.gradient(&self.point.w, &mut self.gradient);
        self.form.jacobian(&self.point.w, &mut self.at.jacobian);
    }

    /// Whether all first-order values are finite.
    pub(super) fn is_finite(&self) -> bool {
        self.objective.is_finite()
            && [&self.c, &self.gradient, &self.at.jacobian].iter().all(|v| v.iter().all(|x| x.is_finite()))
    }

    /// theta = |c|_1.
    pub(super) fn theta(&self) -> f64 {
        self.c.iter().map(|v| v.abs()).sum()
    }

    /// phi_mu.
    pub(super) fn phi(&self) -> f64 {
        self.objective + barrier::barrier_term(&self.form, &self.point.w, self.mu)
    }

    /// Limits of the filter from the violation at the start (WB06 section 2.3).
    pub(super) fn begin_filter(&mut self) {
        let theta = self.theta().max(1.0);
        self.filter = Filter::new(1e4 * theta);
        self.theta_min = 1e-4 * theta;
    }

    fn update_lagrangian(&mut self) {
        self.lagrangian.copy_from_slice(&self.gradient);
        self.form.add_transpose(&self.at.jacobian, &self.point.y, &mut self.lagrangian);
        for j in 0..self.form.length() {
            self.lagrangian[j] += self.point.zu[j] - self.point.zl[j];
        }
    }

    fn optimality(&self, mu: f64) -> Optimality {
        Optimality::new(&self.form, &self.point, &self.at, &self.c, &self.lagrangian, mu)
    }

    /// Largest violation of the rows, unscaled; infinite for NaN.
    fn largest_violation(&self) -> f64 {
        unscaled_violation(&self.c, &self.form.row_scale)
    }

    /// Largest violation of the program's own rows, unscaled, elastics left out.
    pub(super) fn program_violation(&mut self) -> f64 {
        let Objective::Restoration { first, .. } = self.form.objective else { return self.largest_violation() };
        self.own_rows.copy_from_slice(&self.c);
        for (a, t) in self.form.row_variables.iter().zip(&self.point.w[self.form.n..]).skip(first) {
            self.own_rows[a.row] -= a.sign * t;
        }
        unscaled_violation(&self.own_rows, &self.form.row_scale)
    }

    pub(super) fn current_optimality(&mut self) -> Optimality {
        self.update_lagrangian();
        self.optimality(0.0)
    }

    /// Sum of the parts of the primal-dual error at the present mu.
    pub(super) fn primal_dual_error(&mut self) -> f64 {
        self.update_lagrangian();
        let now = self.optimality(self.mu);
        now.violation + now.dual + now.complementarity
    }

    fn is_converged(&self, settings: &NlpSettings, now: &Optimality) -> bool {
        let scale = self.form.objective_scale;
        now.error() <= settings.tolerance
            && self.largest_violation() <= settings.violation_tolerance
            && now.dual / scale <= settings.dual_tolerance
            && now.complementarity / scale <= settings.complementarity_tolerance
    }

    fn set_mu(&mut self, mu: f64) {
        self.mu = mu;
        self.filter.clear();
        self.search.end_watch();
        if let Objective::Restoration { zeta, .. } = &mut self.form.objective {
            *zeta = mu.sqrt();
            self.objective = self.form.objective(&self.point.w);
            self.form.gradient(&self.point.w, &mut self.gradient);
            self.update_lagrangian();
        }
    }

    /// Reduces mu while the barrier problem is solved well enough (`force`: at least once).
    fn update_mu(&mut self, settings: &NlpSettings, now: &Optimality, mut force: bool) {
        let smallest = barrier::smallest_mu(settings, self.form.objective_scale);
        if settings.barrier_strategy == BarrierStrategy::Adaptive {
            let error = now.error();
            let recent = &mut self.free_mu.recent;
            let progress = recent.len() < 4 || recent.iter().any(|e| error <= 0.9999 * e);
            recent.push(error);
            if recent.len() > 4 {
                recent.remove(0);
            }
            if progress && !force {
                if let Some(mu) = barrier::loqo_mu(&self.point, &self.at) {
                    self.free_mu.free = true;
                    self.set_mu(mu.clamp(smallest, 1e5));
                    return;
                }
            } else if self.free_mu.free {
                self.free_mu.free = false;
                let average = barrier::average_complementarity(&self.point, &self.at).unwrap_or(self.mu);
                self.set_mu((0.8 * average).clamp(smallest, 1e5));
            }
        }
        while self.mu > smallest && (force || self.optimality(self.mu).error() <= settings.kappa_epsilon * self.mu) {
            self.set_mu(barrier::reduced_mu(settings, self.mu, smallest));
            force = false;
        }
    }

    /// Newton direction with inertia correction; false when no regularisation gives one.
    fn compute_direction(&mut self, session: &mut Session) -> bool {
        let settings = session.settings;
        if !self.rows_curve {
            self.rows_curve =
                self.phase() == Phase::Restoration || self.largest_violation() <= settings.curvature_from_violation;
        }
        let multipliers = self.rows_curve.then_some(self.point.y.as_slice());
        self.form.hessian(&self.point.w, multipliers, &mut self.at.hessian);
        for j in 0..self.form.length() {
            let (sl, su) = (self.at.slack_lower[j], self.at.slack_upper[j]);
            self.rhs.w[j] = -(self.lagrangian[j] + DAMPING * self.mu * self.form.single_side(j));
            self.rhs.zl[j] = if sl.is_finite() { self.mu - sl * self.point.zl[j] } else { 0.0 };
            self.rhs.zu[j] = if su.is_finite() { self.mu - su * self.point.zu[j] } else { 0.0 };
        }
        for (r, c) in self.rhs.y.iter_mut().zip(&self.c) {
            *r = -c;
        }
        self.correction.begin(settings, self.mu);
        let mut change = Change::Any;
        let mut refusals = 0;
        loop {
            let (dw, dc) = (self.correction.delta_w, self.correction.delta_c);
            let inertia = session.newton.factor(&self.form, &self.point, &self.at, (dw, dc), change);
            if inertia.is_some() {
                change = Change::Diagonal;
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
                    let distrusts = solved.unrefined > settings.residual_limit && session.newton.distrust();
                    let solves = !distrusts && solved.refined <= settings.residual_limit;
                    if solves && self.curves_downwards(&session.newton) {
                        session.newton.distrust() || self.correction.increase(settings)
                    } else if solves {
                        self.correction.accept(settings);
                        return true;
                    } else {
                        distrusts || self.correction.singular(settings, self.mu)
                    }
                }
                Some(i) if i.zero == 0 && i.negative > self.form.m => {
                    // Growth that spoils solutions spoils the count as well. More regularisation only makes it smaller.
                    refusals += 1;
                    let distrusts = refusals == DOUBTED_REFUSAL
                        && session.newton.unrefined_residual(
                            &self.form,
                            &self.point,
                            &self.at,
                            &self.rhs,
                            &mut self.direction,
                        ) > settings.residual_limit
                        && session.newton.distrust();
                    distrusts || self.correction.increase(settings)
                }
                _ => self.correction.singular(settings, self.mu),
            };
            if !go_on {
                return false;
            }
        }
    }

    /// Whether the direction d shows that the factorisation miscounted. With the right inertia and regularised rows
    /// K + A^T A / `delta_c` is positive definite, K = W + Sigma + `delta_w` I; along d, with A d = `delta_c` dy - c and
    /// d^T K d = (c - `delta_c` dy)^T (y + dy) - grad phi^T d, it is the rows' part below less the slope. Rows that are not
    /// regularised, where A d = -c and K has to be positive in their null space only, count as if they were by little: what
    /// they violate excuses any curvature.
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

    /// Row multipliers by least squares at the point; zero when they come out too large or cannot be solved for.
    pub(super) fn estimate_multipliers(&mut self, session: &mut Session) {
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

    fn report(&mut self, session: &mut Session, now: &Optimality) {
        let objective = match self.form.objective {
            Objective::Program => self.objective / self.form.objective_scale,
            Objective::Restoration { .. } => self.form.program.objective(&self.point.w[..self.form.n]),
        };
        let step = session.last_step;
        (session.observer)(&NlpIteration {
            number: session.iterations,
            phase: self.phase(),
            objective,
            violation: self.program_violation(),
            dual_infeasibility: now.dual,
            complementarity: now.complementarity,
            mu: self.mu,
            alpha_primal: step.alpha_primal,
            alpha_dual: step.alpha_dual,
            delta_w: step.delta_w,
            delta_c: step.delta_c,
            trials: step.trials,
        });
    }

    fn phase(&self) -> Phase {
        match self.form.objective {
            Objective::Program => Phase::Regular,
            Objective::Restoration { .. } => Phase::Restoration,
        }
    }

    /// Largest |dw| relative to the point.
    fn relative_step(&self) -> f64 {
        self.direction.w.iter().zip(&self.point.w).fold(0.0, |a: f64, (d, w)| a.max(d.abs() / (1.0 + w.abs())))
    }

    /// Iterates until an ending. `leave` is asked after each step of a restoration phase.
    pub(super) fn iterate(&mut self, session: &mut Session, mut leave: Option<Leave>) -> Ending {
        session.newton.fit(&self.form);
        let settings = session.settings;
        let mut tiny_steps = 0usize;
        let mut rescues = 0usize;
        let mut short_steps = 0usize;
        let mut soft_steps = 0usize;
        let mut elastic_resets = 0usize;
        loop {
            let now = self.current_optimality();
            self.report(session, &now);
            if self.is_converged(settings, &now) {
                return Ending::Converged;
            }
            if (session.cancel)() {
                return Ending::Cancelled;
            }
            if session.iterations >= settings.max_iterations {
                return Ending::IterationLimit;
            }
            if session.started.elapsed().as_secs_f64() >= settings.max_seconds {
                return Ending::TimeLimit;
            }
            if largest(&self.point.w[..self.form.n]) > settings.divergence_limit {
                return Ending::Unbounded;
            }
            if tiny_steps > 1 && self.mu <= barrier::smallest_mu(settings, self.form.objective_scale) {
                return Ending::Stalled;
            }
            self.update_mu(settings, &now, tiny_steps > 0);
            session.iterations += 1;
            match self.phase() {
                Phase::Regular => session.counts.regular_iterations += 1,
                Phase::Restoration => session.counts.restoration_iterations += 1,
            }

            let found = self.compute_direction(session);
            let tiny = found && self.relative_step() < 10.0 * f64::EPSILON && self.theta() < 1e-4;
            tiny_steps = if tiny { tiny_steps + 1 } else { 0 };
            if found && self.line_search(session, tiny) {
                rescues = 0;
                elastic_resets = 0;
                soft_steps = 0;
                if leave.as_mut().is_some_and(|leave| leave(&self.point.w)) {
                    return Ending::Left;
                }
                short_steps = if session.last_step.alpha_primal < SHORT_STEP { short_steps + 1 } else { 0 };
                let crawls = settings.short_step_limit > 0
                    && short_steps >= settings.short_step_limit
                    && self.phase() == Phase::Regular
                    && largest(&self.c) > settings.tolerance
                    && session.counts.restoration_phases < settings.max_restoration_phases;
                if !crawls {
                    continue;
                }
            } else if found && soft_steps < settings.max_soft_steps && self.soft_step(session) {
                soft_steps += 1;
                continue;
            }
            short_steps = 0;
            soft_steps = 0;
            self.search.end_watch();
            session.last_step = StepRecord::default();
            match self.phase() {
                Phase::Restoration => {
                    elastic_resets += 1;
                    if elastic_resets > 2 {
                        return Ending::Stalled;
                    }
                    if elastic_resets > 1 || !restoration::reset_elastics(self) {
                        self.recentre(session);
                    }
                }
                Phase::Regular => {
                    let nearly_feasible = largest(&self.c) <= 1e-2 * settings.tolerance;
                    if nearly_feasible || session.counts.restoration_phases >= settings.max_restoration_phases {
                        rescues += 1;
                        if rescues > 1 {
                            return Ending::Stalled;
                        }
                        self.recentre(session);
                    } else if let Some(ending) = restoration::restore(self, session) {
                        return ending;
                    }
                }
            }
        }
    }

    /// Forgets filter and multipliers: z = mu / slack, y by least squares.
    pub(super) fn recentre(&mut self, session: &mut Session) {
        self.filter.clear();
        self.search.end_watch();
        for j in 0..self.form.length() {
            self.point.zl[j] = if self.at.slack_lower[j].is_finite() { self.mu / self.at.slack_lower[j] } else { 0.0 };
            self.point.zu[j] = if self.at.slack_upper[j].is_finite() { self.mu / self.at.slack_upper[j] } else { 0.0 };
        }
        self.estimate_multipliers(session);
    }

    /// Slack of each row: the slack of an inequality, unscaled; the target of an equality.
    pub(super) fn row_slacks(&self) -> Vec<f64> {
        (0..self.form.m)
            .map(|i| match self.form.rows[i] {
                RowKind::Equality(target) => target / self.form.row_scale[i],
                RowKind::Inequality(k) => self.point.w[self.form.n + k] / self.form.row_scale[i],
                RowKind::Free => 0.0,
            })
            .collect()
    }
}
