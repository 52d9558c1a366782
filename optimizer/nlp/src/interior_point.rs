//! The interior-point iteration on one formulation (WB06 algorithm A): the problem itself, or its restoration phase
//! with elastic variables.

use crate::barrier;
use crate::formulation::Objective;
use crate::iterate::{Iterate, IterationEnd, SolveSession, StepRecord};
use crate::optimality::OptimalityError;
use crate::primal_dual::largest;
use crate::restoration;
use crate::settings::NlpSettings;
use crate::status::{NlpIteration, NlpPhase};

/// Whether a restoration phase ends at this w.
pub(crate) type RestorationExit<'f> = &'f mut dyn FnMut(&[f64]) -> bool;

/// A primal step below this is short (`NlpSettings::short_step_limit`).
const SHORT_STEP: f64 = 0.05;

impl Iterate<'_> {
    fn is_converged(&self, settings: &NlpSettings, now: &OptimalityError) -> bool {
        let scale = self.form.objective_scale;
        now.error() <= settings.tolerance
            && self.largest_violation() <= settings.violation_tolerance
            && now.dual / scale <= settings.constants.dual_tolerance
            && now.complementarity / scale <= settings.complementarity_tolerance
    }

    fn report(&mut self, session: &mut SolveSession, now: &OptimalityError) {
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

    /// Largest |dw| relative to the point.
    fn relative_step(&self) -> f64 {
        self.direction.w.iter().zip(&self.point.w).fold(0.0, |a: f64, (d, w)| a.max(d.abs() / (1.0 + w.abs())))
    }

    /// Runs the restoration phase from the current point. `None` if it reaches an acceptable point; otherwise the
    /// ending of the solve, at the last point of the phase.
    fn restore(&mut self, session: &mut SolveSession) -> Option<IterationEnd> {
        let theta = self.theta();
        let Some(mut phase) = restoration::begin(self, session) else { return Some(IterationEnd::Stalled) };
        let ending = {
            let mut leave = restoration::may_leave(self, session.settings, theta);
            phase.iterate(session, Some(&mut leave))
        };
        restoration::finish(self, session, &phase, ending)
    }

    /// Iterates until an ending. `leave` is called after each step of a restoration phase.
    pub(crate) fn iterate(&mut self, session: &mut SolveSession, mut leave: Option<RestorationExit>) -> IterationEnd {
        session.newton.fit(&self.form);
        let settings = session.settings;
        let mut tiny_steps = 0usize;
        let mut short_steps = 0usize;
        let mut recentred = 0usize;
        loop {
            let now = self.current_optimality();
            self.report(session, &now);
            if self.is_converged(settings, &now) {
                return IterationEnd::Converged;
            }
            if (session.cancel)() {
                return IterationEnd::Cancelled;
            }
            if session.iterations >= settings.max_iterations {
                return IterationEnd::IterationLimit;
            }
            if session.started.elapsed().as_secs_f64() >= settings.max_seconds {
                return IterationEnd::TimeLimit;
            }
            if largest(&self.point.w[..self.form.n]) > settings.constants.divergence_limit {
                return IterationEnd::Unbounded;
            }
            if tiny_steps > 1 && self.mu <= barrier::smallest_mu(settings, self.form.objective_scale) {
                return IterationEnd::Stalled;
            }
            self.update_mu(settings, &now, tiny_steps > 0);
            session.iterations += 1;
            match self.phase() {
                NlpPhase::Regular => session.counts.regular_iterations += 1,
                NlpPhase::Restoration => session.counts.restoration_iterations += 1,
            }

            let found = self.compute_direction(session);
            let tiny = found && self.relative_step() < 10.0 * f64::EPSILON && self.theta() < 1e-4;
            tiny_steps = if tiny { tiny_steps + 1 } else { 0 };
            if found && self.line_search(session) {
                recentred = 0;
                if leave.as_mut().is_some_and(|leave| leave(&self.point.w)) {
                    return IterationEnd::Left;
                }
                short_steps = if session.last_step.alpha_primal < SHORT_STEP { short_steps + 1 } else { 0 };
                let crawls = settings.short_step_limit > 0
                    && short_steps >= settings.short_step_limit
                    && self.phase() == NlpPhase::Regular
                    && largest(&self.c) > settings.tolerance
                    && session.counts.restoration_phases < settings.constants.max_restoration_phases;
                if !crawls {
                    continue;
                }
            }
            short_steps = 0;
            self.search.end_watch();
            session.last_step = StepRecord::default();
            match self.phase() {
                NlpPhase::Restoration => {
                    recentred += 1;
                    if recentred > 2 {
                        return IterationEnd::Stalled;
                    }
                    self.recentre(session);
                }
                NlpPhase::Regular => {
                    let nearly_feasible = largest(&self.c) <= 1e-2 * settings.tolerance;
                    if nearly_feasible || session.counts.restoration_phases >= settings.constants.max_restoration_phases
                    {
                        return IterationEnd::Stalled;
                    }
                    if let Some(ending) = self.restore(session) {
                        return ending;
                    }
                }
            }
        }
    }
}
