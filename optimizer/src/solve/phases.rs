//! A solver run in progress: its phases and their cost.

use super::cold_start_guesses::{InitialGuess, MuscleRoute};
use super::error::SolveError;
use super::options::SolveOptions;
use super::progress::{IterationRecord, SolvePhase};
use super::solve_report::{CONVERGED_VIOLATION, LinearAlgebra};
use super::time_limit;
use crate::cancel_token::CancelToken;
use crate::gait_problem::{GaitProblem, GaitProgram};
use crate::initial_guess;
use interior_point::{
    NlpCounts, NlpError, NlpResult, NlpSettings, NlpStatus, NonlinearProgram, Residuals, StartPoint, Timing, WarmPoint,
};
use std::time::Instant;

/// Initial barrier parameter of the tracking phases. It is small, because at 0.1 the barrier terms of 7,000 bounds
/// dominate an objective of 0.06 and destroy the natural guess.
const MU_TRACKING: f64 = 1e-3;
const MU_MUSCLE_TRACKING: f64 = 1e-2;
/// Weight of the tracking term in the tracking phases. Larger weights take more iterations; smaller ones lead to
/// worse local optima with muscles.
const TRACKING_WEIGHT: f64 = 3.0;
/// Tolerances of a phase whose result is only a start: error, complementarity (at the initial barrier parameter) and
/// violation. Tighter ones cost iterations and save none in later phases.
const ROUGH: f64 = 1e-2;
const ROUGH_VIOLATION: f64 = 1e-3;
/// Iteration limit of a tracking phase. Usually it takes about ten. With nearly infeasible bounds it may take a
/// thousand, and the cost phase can continue from any point.
const MAX_TRACKING_ITERATIONS: usize = 200;
/// Violation before the projection into the bounds, as a share of the allowed violation.
const VIOLATION_SHARE: f64 = 0.3;
/// Initial barrier parameter of a cost phase without warm start.
const MU_COST: f64 = 1e-4;
/// Distance from the bounds, relative and as a share of their width, of the first point of a phase.
const WARM_PUSH: f64 = 1e-7;

/// Factor on the barrier parameter of the guess in a cost phase without muscles, which saves iterations. With muscles
/// it would lead to worse local optima, near the reference gait.
const PLAIN_BARRIER_SHARE: f64 = 0.1;

/// The common data of all solver runs of a solve.
#[derive(Clone, Copy)]
pub(super) struct SolveContext<'a> {
    pub(super) problem: &'a GaitProblem,
    pub(super) program: &'a GaitProgram,
    pub(super) options: &'a SolveOptions,
    pub(super) cancel: &'a CancelToken,
    pub(super) started: Instant,
}

/// A solver run.
pub(super) struct RunInProgress<'a> {
    context: &'a SolveContext<'a>,
    threads: usize,
    observer: &'a mut dyn FnMut(&IterationRecord),
    begun: Instant,
    /// Number of the initial guess.
    pub(super) guess: usize,
    pub(super) iterations: usize,
    pub(super) evaluation_s: f64,
    pub(super) linear_algebra: LinearAlgebra,
    /// The reason why a phase could not start; empty otherwise.
    pub(super) reason: String,
}

impl<'a> RunInProgress<'a> {
    pub(super) fn new(
        context: &'a SolveContext<'a>,
        threads: usize,
        observer: &'a mut dyn FnMut(&IterationRecord),
    ) -> Self {
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

    /// Time since the start of the run, s.
    pub(super) fn seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    fn phase(
        &mut self,
        phase: SolvePhase,
        program: &GaitProgram,
        start: &StartPoint,
        settings: &NlpSettings,
    ) -> Result<NlpResult, SolveError> {
        let options = self.context.options;
        let most = match phase {
            SolvePhase::Tracking | SolvePhase::MuscleTracking => MAX_TRACKING_ITERATIONS,
            SolvePhase::PlainCost | SolvePhase::Cost | SolvePhase::InterNode => usize::MAX,
        };
        let settings = NlpSettings {
            max_seconds: time_limit::remaining_s(options, self.context.started),
            max_iterations: options.max_iterations.min(most),
            threads: self.threads,
            ..*settings
        };
        let (before, guess) = (self.iterations, self.guess);
        let observer = &mut *self.observer;
        let result = interior_point::solve(
            program,
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
            // The starting point is unusable.
            Err(error @ (NlpError::EvaluationFailed { .. } | NlpError::InvalidStart(_))) => {
                self.reason = error.to_string();
                return Ok(stuck(program, start));
            }
            other => other?,
        };
        self.iterations += result.iterations;
        self.evaluation_s += result.timing.evaluation;
        self.linear_algebra.add_phase(&result);
        Ok(result)
    }

    /// Whether the run was cancelled or reached its time limit.
    pub(super) fn interrupted(result: &NlpResult) -> bool {
        matches!(result.status, NlpStatus::Cancelled | NlpStatus::TimeLimit)
    }

    /// The tracking phases, by the route of the guess, then the cost phase.
    pub(super) fn cold(&mut self, guess: &InitialGuess) -> Result<NlpResult, SolveError> {
        let (problem, program) = (self.context.problem, self.context.program);
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
            SolvePhase::Tracking,
            &plain.for_tracking(TRACKING_WEIGHT),
            &StartPoint::Cold(first),
            &tracking_settings,
        )?;
        if problem.muscles {
            if guess.route == MuscleRoute::PlainOptimum && !Self::interrupted(&tracked) {
                let settings = NlpSettings { mu_initial: MU_COST, ..rough };
                tracked = self.phase(SolvePhase::PlainCost, &plain, &StartPoint::Cold(tracked.x), &settings)?;
            }
            let with_muscles = initial_guess::with_muscles(program, &plain, &tracked.x);
            if Self::interrupted(&tracked) {
                return Ok(blank(program, with_muscles, tracked));
            }
            if guess.route == MuscleRoute::MuscleTracking {
                tracked = self.phase(
                    SolvePhase::MuscleTracking,
                    &tracked_problem
                        .program(true)?
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
            // Keep the nearly feasible point: a larger distance from its bounds would increase the violation up to a
            // million times in short domains.
            usual.bound_push = WARM_PUSH;
        }
        self.phase(SolvePhase::Cost, program, &StartPoint::Cold(tracked.x), &guess.strategy.applied(&usual))
    }

    /// Starts with the mean complementarity of the point as barrier parameter. Larger and smaller values take more
    /// iterations.
    pub(super) fn warm(
        &mut self,
        phase: SolvePhase,
        program: &GaitProgram,
        point: WarmPoint,
    ) -> Result<NlpResult, SolveError> {
        self.phase(
            phase,
            program,
            &StartPoint::Warm(point),
            &NlpSettings {
                mu_initial: MU_COST,
                warm_bound_push: WARM_PUSH,
                ..self.last_phase(&self.context.options.solver)
            },
        )
    }

    fn last_phase(&self, settings: &NlpSettings) -> NlpSettings {
        to_final_tolerance(settings, self.context.options.tolerance)
    }
}

/// Solves to the final tolerance. The projection into the bounds may change rows by up to a hundred times the distance,
/// so bounds are relaxed by little compared with the tolerance, and the violation has a margin.
fn to_final_tolerance(settings: &NlpSettings, tolerance: f64) -> NlpSettings {
    NlpSettings {
        tolerance,
        violation_tolerance: settings.violation_tolerance.min(VIOLATION_SHARE * CONVERGED_VIOLATION),
        bound_relaxation: settings.bound_relaxation.min(0.01 * tolerance),
        ..*settings
    }
}

/// Settings of the solver in the last phase of a solve.
pub(crate) fn final_settings(options: &SolveOptions) -> NlpSettings {
    to_final_tolerance(&options.solver, options.tolerance)
}

/// The result of a solve that ended at its starting point.
fn stuck(program: &GaitProgram, start: &StartPoint) -> NlpResult {
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
        counts: NlpCounts::default(),
        timing: Timing::default(),
    };
    blank(program, x, nothing)
}

/// A result with the dimensions of `program` and multipliers without information.
#[allow(clippy::needless_pass_by_value)] // The replaced vectors are not needed any more.
fn blank(program: &GaitProgram, x: Vec<f64>, result: NlpResult) -> NlpResult {
    let (n, m) = (program.variables(), program.rows());
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
