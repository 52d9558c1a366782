//! One attempt in progress: its phases, and what they cost.

use super::attempts::CONVERGED_VIOLATION;
use super::cold_guesses::{ColdGuess, ColdRoute};
use super::{CancelToken, GaitProblem, IterationRecord, LinearAlgebra, Phase, SolveError, SolveOptions};
use crate::cold_start;
use crate::gait_problem::GaitProgramme;
use crate::nlp::{
    self, Counts, NlpError, NlpResult, NlpSettings, NlpStatus, NonlinearProgram, Residuals, StartPoint, Timing,
    WarmPoint,
};
use std::time::Instant;

/// First barrier parameter of the tracking phases of a cold start. Small values keep the natural guess: at 0.1 the
/// barrier of 7,000 bounds swamps a cost of 0.06.
const MU_TRACKING: f64 = 1e-3;
const MU_MUSCLE_TRACKING: f64 = 1e-2;
/// Weight of the tracking phases. Ten takes a tenth more iterations in all; one takes the fewest without muscles, and with them
/// leads to dearer gaits.
const TRACKING_WEIGHT: f64 = 3.0;
/// Tolerances of a phase whose end is but a start: error, complementarity (it stays at the first barrier parameter),
/// violation. Smaller ones cost iterations and save none afterwards.
const ROUGH: f64 = 1e-2;
const ROUGH_VIOLATION: f64 = 1e-3;
/// Most iterations of a phase that tracks the reference. It takes some ten; on bounds with hardly a gait it may take a
/// thousand, and the cost phase goes on from wherever it is.
const MOST_TRACKING_ITERATIONS: usize = 200;
/// Share of the violation allowed in an answer that is allowed before it is moved into its bounds.
const VIOLATION_SHARE: f64 = 0.3;
/// First barrier parameter of a cost phase that may not choose its own.
const MU_COST: f64 = 1e-4;
/// Distance from its bounds, relative and as a share of their width, that a point keeps on to which a phase goes.
const WARM_PUSH: f64 = 1e-7;

/// Without muscles the cost phase begins with this share of the guess's barrier parameter: a fifth fewer iterations. With
/// muscles it would keep dearer gaits, which are nearer to the reference.
const PLAIN_BARRIER_SHARE: f64 = 0.1;

/// What all attempts of one solve share.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub(super) problem: &'a GaitProblem,
    pub(super) programme: &'a GaitProgramme,
    pub(super) options: &'a SolveOptions,
    pub(super) cancel: &'a CancelToken,
    pub(super) started: Instant,
}

/// One attempt.
pub(super) struct Run<'a> {
    context: &'a Context<'a>,
    threads: usize,
    observer: &'a mut dyn FnMut(&IterationRecord),
    begun: Instant,
    /// Number of the cold guess.
    pub(super) guess: usize,
    pub(super) iterations: usize,
    pub(super) evaluation_s: f64,
    pub(super) linear_algebra: LinearAlgebra,
    /// Why a phase could not begin; empty when all could.
    pub(super) reason: String,
}

impl<'a> Run<'a> {
    pub(super) fn new(context: &'a Context<'a>, threads: usize, observer: &'a mut dyn FnMut(&IterationRecord)) -> Self {
        Self {
            context,
            threads,
            observer,
            begun: Instant::now(),
            guess: 0,
            iterations: 0,
            evaluation_s: 0.0,
            linear_algebra: LinearAlgebra::default(),
            reason: String::new(),
        }
    }

    /// Seconds since the attempt began.
    pub(super) fn seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    fn phase(
        &mut self,
        phase: Phase,
        programme: &GaitProgramme,
        start: &StartPoint,
        settings: &NlpSettings,
    ) -> Result<NlpResult, SolveError> {
        let options = self.context.options;
        let remaining = options
            .time_limit_s
            .map_or(f64::INFINITY, |limit| (limit - self.context.started.elapsed().as_secs_f64()).max(0.0));
        let most = match phase {
            Phase::Tracking | Phase::MuscleTracking => MOST_TRACKING_ITERATIONS,
            Phase::PlainCost | Phase::Cost | Phase::BetweenPoints => usize::MAX,
        };
        let settings = NlpSettings {
            max_seconds: remaining,
            max_iterations: options.max_iterations.min(most),
            threads: self.threads,
            ..*settings
        };
        let (before, guess) = (self.iterations, self.guess);
        let observer = &mut *self.observer;
        let result = nlp::solve(
            programme,
            start,
            &settings,
            &mut |record| {
                observer(&IterationRecord {
                    iteration: before + record.number,
                    phase,
                    objective: record.objective,
                    constraint_violation: record.violation,
                    dual_infeasibility: record.dual_infeasibility,
                    barrier: record.mu,
                    step: record.alpha_primal,
                    guess,
                });
            },
            &|| self.context.cancel.is_cancelled(),
        );
        let result = match result {
            // The fault of the start, not of the program: nothing can be done from there.
            Err(error @ (NlpError::EvaluationFailed { .. } | NlpError::InvalidStart(_))) => {
                self.reason = error.to_string();
                return Ok(stuck(programme, start));
            }
            other => other?,
        };
        self.iterations += result.iterations;
        self.evaluation_s += result.timing.evaluation;
        self.linear_algebra.add_phase(&result);
        Ok(result)
    }

    /// Whether the caller or the clock ended it.
    pub(super) fn interrupted(result: &NlpResult) -> bool {
        matches!(result.status, NlpStatus::Cancelled | NlpStatus::TimeLimit)
    }

    /// Tracking, with muscles by the guess's route, then cost.
    pub(super) fn cold(&mut self, guess: &ColdGuess) -> Result<NlpResult, SolveError> {
        let (problem, programme) = (self.context.problem, self.context.programme);
        let tracked_problem = guess.tracked(problem);
        let (plain, first) = guess.begin(&tracked_problem, &|| self.context.cancel.is_cancelled())?;
        let every_phase = NlpSettings { curvature_from_violation: guess.curvature_from, ..self.context.options.solver };
        let rough = NlpSettings {
            tolerance: ROUGH,
            complementarity_tolerance: ROUGH,
            violation_tolerance: ROUGH_VIOLATION,
            ..every_phase
        };
        let tracking_settings = NlpSettings { mu_initial: MU_TRACKING, ..rough };
        let mut tracked = self.phase(
            Phase::Tracking,
            &plain.for_tracking(TRACKING_WEIGHT),
            &StartPoint::Cold(first),
            &tracking_settings,
        )?;
        if problem.muscles {
            if guess.route == ColdRoute::PlainOptimum && !Self::interrupted(&tracked) {
                let settings = NlpSettings { mu_initial: MU_COST, ..rough };
                tracked = self.phase(Phase::PlainCost, &plain, &StartPoint::Cold(tracked.x), &settings)?;
            }
            let with_muscles = cold_start::muscles::guess(programme, &plain, &tracked.x);
            if Self::interrupted(&tracked) {
                return Ok(blank(programme, with_muscles, tracked));
            }
            if guess.route == ColdRoute::MuscleTracking {
                tracked = self.phase(
                    Phase::MuscleTracking,
                    &tracked_problem
                        .programme(true)?
                        .with_timing(&guess.timing.fractions())
                        .for_tracking(TRACKING_WEIGHT),
                    &StartPoint::Cold(with_muscles),
                    &NlpSettings { mu_initial: MU_MUSCLE_TRACKING, ..tracking_settings },
                )?;
            } else {
                tracked.x = with_muscles;
            }
        }
        if Self::interrupted(&tracked) {
            return Ok(tracked);
        }
        let mu_initial = if problem.muscles { guess.barrier } else { PLAIN_BARRIER_SHARE * guess.barrier };
        let mut usual = NlpSettings { mu_initial, ..self.last_phase(&every_phase) };
        if tracked.status != NlpStatus::Converged {
            // As near to feasible as it came (with muscles: its motion is): away from its bounds it violates up to a million
            // times as much where domains are short.
            (usual.bound_push, usual.bound_fraction) = (WARM_PUSH, WARM_PUSH);
        }
        self.phase(Phase::Cost, programme, &StartPoint::Cold(tracked.x), &guess.strategy.applied(&usual))
    }

    /// Begins with the barrier parameter that the point's own complementarity has in the mean: larger ones, by the violation
    /// of the changed bounds, forget the point (twice to four times the iterations), smaller ones take more as well.
    pub(super) fn warm(
        &mut self,
        phase: Phase,
        programme: &GaitProgramme,
        point: WarmPoint,
    ) -> Result<NlpResult, SolveError> {
        self.phase(
            phase,
            programme,
            &StartPoint::Warm(point),
            &NlpSettings {
                mu_initial: MU_COST,
                warm_bound_push: WARM_PUSH,
                warm_bound_fraction: WARM_PUSH,
                ..self.last_phase(&self.context.options.solver)
            },
        )
    }

    /// With the tolerance of the answer. The answer is moved back into its bounds, which rows answer with up to a hundred
    /// times the way: bounds are widened by little beside the tolerance, and the violation leaves room for what that adds.
    fn last_phase(&self, settings: &NlpSettings) -> NlpSettings {
        let tolerance = self.context.options.tolerance;
        NlpSettings {
            tolerance,
            violation_tolerance: settings.violation_tolerance.min(VIOLATION_SHARE * CONVERGED_VIOLATION),
            bound_relaxation: settings.bound_relaxation.min(0.01 * tolerance),
            ..*settings
        }
    }
}

/// A solve that ended where it began.
fn stuck(programme: &GaitProgramme, start: &StartPoint) -> NlpResult {
    let x = match start {
        StartPoint::Cold(x) => x.clone(),
        StartPoint::Warm(warm) => warm.x.clone(),
    };
    let unknown = Residuals { violation: f64::NAN, dual_infeasibility: f64::NAN, complementarity: f64::NAN };
    let nothing = NlpResult {
        status: NlpStatus::Stalled,
        x: Vec::new(),
        row_multipliers: Vec::new(),
        lower_multipliers: Vec::new(),
        upper_multipliers: Vec::new(),
        slacks: Vec::new(),
        slack_lower_multipliers: Vec::new(),
        slack_upper_multipliers: Vec::new(),
        objective: f64::NAN,
        residuals: unknown,
        scaled_residuals: unknown,
        mu: 0.0,
        iterations: 0,
        counts: Counts::default(),
        timing: Timing::default(),
    };
    blank(programme, x, nothing)
}

/// A result in the shape of `programme` whose multipliers carry no information.
#[allow(clippy::needless_pass_by_value)] // the replaced vectors are not needed any more
fn blank(programme: &GaitProgramme, x: Vec<f64>, result: NlpResult) -> NlpResult {
    let (n, m) = (programme.variables(), programme.rows());
    NlpResult {
        x,
        row_multipliers: vec![0.0; m],
        lower_multipliers: vec![0.0; n],
        upper_multipliers: vec![0.0; n],
        slacks: vec![0.0; m],
        slack_lower_multipliers: vec![0.0; m],
        slack_upper_multipliers: vec![0.0; m],
        ..result
    }
}
