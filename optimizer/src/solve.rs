//! The public face: one gait problem in, one honest outcome out.

use crate::bounds::TunedBounds;
use crate::device::Device;
use crate::gait::Gait;
use crate::gait_problem::GaitProgramme;
use crate::gait_problem::programme::RowViolation;
use crate::metrics::gait_rmse;
use crate::nlp::{NlpError, NlpStatus, NonlinearProgram, WarmPoint};
use crate::reference::ReferenceGait;
use crate::settings::{GaitSettings, Mesh};
use crate::subject::{ModelError, Subject};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use thiserror::Error;

mod cold_guesses;
mod run;

pub use cold_guesses::{Attempt, BasinChoice, ColdGuess, ColdRoute, GuessTiming};
use cold_guesses::{Choice, Tried, choose, try_guesses, try_warm};
use run::Context;

/// One gait problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaitProblem {
    /// Who walks.
    pub subject: Subject,
    /// With which prosthesis (right leg).
    pub device: Device,
    /// Tuned bounds a1..a8.
    pub bounds: TunedBounds,
    /// With muscles (C1-C12) or without (C1-C4).
    pub muscles: bool,
    /// Other settings of the problem.
    pub settings: GaitSettings,
    /// Reference for Gait RMSE and for the cold start.
    pub reference: ReferenceGait,
}

/// How a solve ended. Only `Converged` is a gait that satisfies every constraint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SolveStatus {
    /// First-order optimal and feasible to tolerance.
    Converged,
    /// The constraint violation is at a stationary point: locally infeasible.
    Infeasible,
    /// No further progress could be made.
    Stalled,
    /// Iteration limit reached.
    IterationLimit,
    /// Time limit reached.
    TimeLimit,
    /// Cancelled through the token.
    Cancelled,
}

/// One line of progress.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct IterationRecord {
    /// Iteration number over all phases of this solve.
    pub iteration: usize,
    /// Phase of the solve: `tracking`, `muscle_tracking`, `cost`, ...
    pub phase: Phase,
    /// Objective of the phase.
    pub objective: f64,
    /// Largest violation of a scaled constraint row.
    pub constraint_violation: f64,
    /// Largest entry of the dual infeasibility.
    pub dual_infeasibility: f64,
    /// Barrier parameter.
    pub barrier: f64,
    /// Primal step length.
    pub step: f64,
    /// Cold guess it belongs to, from 0; several may run at the same time.
    #[serde(default)]
    pub guess: usize,
}

/// Phase of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Tracking the reference without muscles (cold start).
    Tracking,
    /// Tracking the reference with muscles (cold start).
    MuscleTracking,
    /// Minimising the cost of transport without muscles, as the start of a gait with muscles (cold start).
    PlainCost,
    /// Minimising the cost of transport.
    Cost,
}

/// Stops a solve from another thread within one iteration.
#[derive(Debug, Clone, Default)]
pub struct CancelToken(Arc<AtomicBool>);

impl CancelToken {
    /// A token that is not cancelled.
    pub fn new() -> Self {
        Self::default()
    }
    /// Asks every solve that holds this token to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
    /// Whether [`Self::cancel`] was called.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Primal-dual point of an earlier solve of a problem of the same mesh and variant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarmStart {
    /// Variant it belongs to.
    pub muscles: bool,
    /// Mesh it belongs to.
    pub mesh: Mesh,
    /// Scaled primal variables and all multipliers.
    pub point: WarmPoint,
}

/// Limits and numerical options of one solve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolveOptions {
    /// Scaled optimality tolerance.
    pub tolerance: f64,
    /// Most iterations of the final phase.
    pub max_iterations: usize,
    /// Most seconds of wall time for the whole solve; `None`: no limit.
    pub time_limit_s: Option<f64>,
    /// Threads, 1 to 16: for the cold guesses side by side, then for the linear algebra of each. The result does not
    /// depend on it.
    pub threads: usize,
    /// How many guesses of [`ColdGuess::CATALOGUE`] a cold start tries.
    pub cold_guesses: usize,
    /// Which of the converged guesses is the answer.
    pub basin_choice: BasinChoice,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            max_iterations: 1000,
            time_limit_s: None,
            threads: 1,
            cold_guesses: 2,
            basin_choice: BasinChoice::default(),
        }
    }
}

impl SolveOptions {
    /// Checks every option.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] naming the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        ModelError::check_range("tolerance", self.tolerance, 1e-10, 1e-2)?;
        ModelError::check_range("max_iterations", self.max_iterations as f64, 1.0, 1e6)?;
        ModelError::check_range("threads", self.threads as f64, 1.0, 16.0)?;
        ModelError::check_range("cold_guesses", self.cold_guesses as f64, 1.0, ColdGuess::CATALOGUE.len() as f64)?;
        self.basin_choice.validate()?;
        if let Some(limit) = self.time_limit_s {
            ModelError::check_range("time_limit_s", limit, 0.0, 1e7)?;
        }
        Ok(())
    }
}

/// Largest scaled violation of a gait that is called converged.
pub const CONVERGED_VIOLATION: f64 = 1e-6;

/// What a solve started from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartedFrom {
    /// Its own cold start.
    Cold,
    /// The warm start that was given.
    Warm,
    /// A cold start after the given warm start did not converge.
    ColdAfterWarm,
}

/// The figures of one solve: a contract for scripts (`gaitwright solve --json`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolveReport {
    /// How it ended.
    pub status: SolveStatus,
    /// What it started from.
    pub started_from: StartedFrom,
    /// Interior-point iterations over all phases.
    pub iterations: usize,
    /// Objective: cost of transport plus regularisation.
    pub objective: f64,
    /// Mechanical cost of transport, dimensionless.
    pub cost_of_transport: f64,
    /// Gait RMSE: sum over the five human coordinates, rad.
    pub gait_rmse_rad: f64,
    /// Its parts: torso, hip_L, knee_L, ankle_L, hip_R.
    pub gait_rmse_parts_rad: [f64; 5],
    /// Largest violation of any constraint row or bound, in scaled units.
    pub max_violation: f64,
    /// Wall time, s.
    pub seconds_total: f64,
    /// Of which evaluating functions and derivatives.
    pub seconds_evaluation: f64,
    /// Of which factorising and solving.
    pub seconds_linear_algebra: f64,
    /// Number of variables.
    pub variables: usize,
    /// Number of equality rows.
    pub equalities: usize,
    /// Number of inequality rows.
    pub inequalities: usize,
    /// Mean walking speed, m/s.
    pub speed_m_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
    /// Durations of the eight domains, s.
    pub durations_s: [f64; 8],
    /// v_hip of the four impact-free runs, m/s.
    pub vhip_m_s: [f64; 4],
    /// Everything that was tried, in order; the figures above are those of the chosen one, iterations and seconds the
    /// sum.
    #[serde(default)]
    pub attempts: Vec<Attempt>,
}

/// A constraint row or bound that is not met, in words and numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Violation {
    /// Name of the row: domain, node, constraint, component.
    pub row: String,
    /// By how much, in `unit`.
    pub amount: f64,
    /// Unit of `amount`.
    pub unit: String,
}

/// What a solve gives back, converged or not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolveOutcome {
    /// The figures.
    pub report: SolveReport,
    /// The last iterate as a gait. Only a gait to trust when the status is `Converged`.
    pub gait: Gait,
    /// For warm-starting another solve.
    pub warm_start: WarmStart,
    /// The most violated rows, worst first; empty when converged.
    pub violations: Vec<Violation>,
}

/// Why a solve could not even be tried.
#[derive(Debug, Error)]
pub enum SolveError {
    /// The input is not a valid problem.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The warm start does not belong to a problem of this shape.
    #[error("the warm start is of another problem: {0}")]
    WarmStartShape(String),
    /// The interior point refused its input.
    #[error(transparent)]
    Solver(#[from] NlpError),
}

impl GaitProblem {
    /// A problem with the built-in device and reference, default bounds and settings.
    ///
    /// # Errors
    /// [`ModelError`] naming what is out of range.
    pub fn new(subject: Subject, muscles: bool) -> Result<Self, ModelError> {
        subject.validate()?;
        Ok(Self {
            subject,
            device: Device::ampro3()?,
            bounds: TunedBounds::default(),
            muscles,
            settings: GaitSettings::default(),
            reference: ReferenceGait::builtin()?,
        })
    }

    fn programme(&self, muscles: bool) -> Result<GaitProgramme, ModelError> {
        GaitProgramme::new(&self.subject, &self.device, &self.bounds, muscles, &self.settings, &self.reference)
    }
}

/// Solves one gait problem. Deterministic: same inputs, same bits.
///
/// A cold start tries [`SolveOptions::cold_guesses`] guesses and keeps one by [`SolveOptions::basin_choice`]. A warm start
/// that does not converge falls back to a cold start; when that does not converge either, the outcome is where the
/// violation is smallest. `observer` is called once per iteration, on the calling thread.
/// A solve that ends without a gait is an `Ok` outcome with another status than `Converged`.
///
/// # Errors
/// [`SolveError`] when the input is invalid.
pub fn solve(
    problem: &GaitProblem,
    warm_start: Option<&WarmStart>,
    options: &SolveOptions,
    observer: &mut dyn FnMut(&IterationRecord),
    cancel: &CancelToken,
) -> Result<SolveOutcome, SolveError> {
    options.validate()?;
    let programme = problem.programme(problem.muscles)?;
    if let Some(warm) = warm_start {
        check_shape(problem, &programme, warm)?;
    }
    let context = Context { problem, programme: &programme, options, cancel, started: Instant::now() };
    let mut tried = Vec::new();
    if let Some(warm) = warm_start {
        let warm = try_warm(&context, warm, observer)?;
        let settled =
            matches!(warm.choice.status, SolveStatus::Converged | SolveStatus::Cancelled | SolveStatus::TimeLimit);
        tried.push(warm);
        if settled {
            return finish(&context, tried, StartedFrom::Warm, StartedFrom::Warm);
        }
    }
    let (first, others) = match warm_start {
        Some(_) => (StartedFrom::Warm, StartedFrom::ColdAfterWarm),
        None => (StartedFrom::Cold, StartedFrom::Cold),
    };
    let guesses = options.cold_guesses;
    tried.extend(try_guesses(&context, &ColdGuess::CATALOGUE[..guesses], observer)?);
    finish(&context, tried, first, others)
}

/// Solves one gait problem cold from the given guesses only: for studies of basins.
///
/// # Errors
/// [`SolveError`] when the input is invalid or there is no guess.
pub fn solve_from_guesses(
    problem: &GaitProblem,
    guesses: &[ColdGuess],
    options: &SolveOptions,
    observer: &mut dyn FnMut(&IterationRecord),
    cancel: &CancelToken,
) -> Result<SolveOutcome, SolveError> {
    options.validate()?;
    for guess in guesses {
        guess.validate()?;
    }
    ModelError::check_range("number of guesses", guesses.len() as f64, 1.0, 1e3)?;
    let programme = problem.programme(problem.muscles)?;
    let context = Context { problem, programme: &programme, options, cancel, started: Instant::now() };
    let tried = try_guesses(&context, guesses, observer)?;
    finish(&context, tried, StartedFrom::Cold, StartedFrom::Cold)
}

/// The outcome of what was tried: `first` and `others` say what the first and the other attempts started from.
fn finish(
    context: &Context<'_>,
    tried: Vec<Tried>,
    first: StartedFrom,
    others: StartedFrom,
) -> Result<SolveOutcome, SolveError> {
    let chosen = choose(&tried, context.options.basin_choice);
    let mut tally = Tally::default();
    let mut answer = None;
    for (index, mut one) in tried.into_iter().enumerate() {
        one.attempt.chosen = index == chosen;
        tally.iterations += one.attempt.iterations;
        tally.evaluation_s += one.evaluation_s;
        tally.linear_algebra_s += one.linear_algebra_s;
        tally.attempts.push(one.attempt);
        if index == chosen {
            answer = Some(one.choice);
        }
    }
    match answer {
        Some(answer) => Ok(outcome(context, answer, tally, if chosen == 0 { first } else { others })),
        None => {
            Err(ModelError::OutOfRange { field: "guesses".to_owned(), value: 0.0, minimum: 1.0, maximum: 1e3 }.into())
        }
    }
}

/// What all attempts of one solve cost together.
#[derive(Default)]
struct Tally {
    iterations: usize,
    evaluation_s: f64,
    linear_algebra_s: f64,
    attempts: Vec<Attempt>,
}

fn check_shape(problem: &GaitProblem, programme: &GaitProgramme, warm: &WarmStart) -> Result<(), SolveError> {
    if warm.muscles != problem.muscles {
        return Err(SolveError::WarmStartShape(format!(
            "it is {} muscles, the problem is {} muscles",
            if warm.muscles { "with" } else { "without" },
            if problem.muscles { "with" } else { "without" }
        )));
    }
    if warm.mesh != problem.settings.mesh {
        return Err(SolveError::WarmStartShape(format!(
            "its mesh is {}, the problem's is {} (intervals of DS2,DS3,SS2,SS1)",
            in_words(&warm.mesh),
            in_words(&problem.settings.mesh)
        )));
    }
    let (n, m) = (programme.variables(), programme.rows());
    let point = &warm.point;
    for (name, found, expected) in [
        ("variables", point.x.len(), n),
        ("lower multipliers", point.lower_multipliers.len(), n),
        ("upper multipliers", point.upper_multipliers.len(), n),
        ("row multipliers", point.row_multipliers.len(), m),
        ("slacks", point.slacks.len(), m),
        ("lower slack multipliers", point.slack_lower_multipliers.len(), m),
        ("upper slack multipliers", point.slack_upper_multipliers.len(), m),
    ] {
        if found != expected {
            return Err(SolveError::WarmStartShape(format!("{found} {name}, expected {expected}")));
        }
    }
    Ok(())
}

fn in_words(mesh: &Mesh) -> String {
    format!("{},{},{},{}", mesh.ds2, mesh.ds3, mesh.ss2, mesh.ss1)
}

fn status_of(status: NlpStatus) -> SolveStatus {
    match status {
        NlpStatus::Converged => SolveStatus::Converged,
        NlpStatus::Infeasible => SolveStatus::Infeasible,
        NlpStatus::IterationLimit => SolveStatus::IterationLimit,
        NlpStatus::TimeLimit => SolveStatus::TimeLimit,
        NlpStatus::Cancelled => SolveStatus::Cancelled,
        _ => SolveStatus::Stalled,
    }
}

/// Most violations reported.
const MAX_VIOLATIONS: usize = 20;

fn outcome(context: &Context<'_>, choice: Choice, tally: Tally, started_from: StartedFrom) -> SolveOutcome {
    let (problem, programme) = (context.problem, context.programme);
    let Choice { result, gait, status, .. } = choice;
    let x = &result.x;
    let rmse = gait_rmse(&gait, &problem.reference);
    let violations = programme.violations(x);
    let parts = programme.objective_parts(x);
    let equalities = (0..programme.rows()).filter(|&r| programme.rows.lower[r] == programme.rows.upper[r]).count();
    let report = SolveReport {
        status,
        started_from,
        iterations: tally.iterations,
        objective: programme.objective(x),
        cost_of_transport: parts.cost_of_transport,
        gait_rmse_rad: rmse.total,
        gait_rmse_parts_rad: rmse.parts,
        max_violation: violations.first().map_or(0.0, |v| v.amount),
        seconds_total: context.started.elapsed().as_secs_f64(),
        seconds_evaluation: tally.evaluation_s,
        seconds_linear_algebra: tally.linear_algebra_s,
        variables: programme.variables(),
        equalities,
        inequalities: programme.rows() - equalities,
        speed_m_s: gait.speed_m_s,
        stride_length_m: gait.stride_length_m,
        durations_s: std::array::from_fn(|d| gait.domains[d].duration_s),
        vhip_m_s: gait.hip_velocity_m_s,
        attempts: tally.attempts,
    };
    let violations = if status == SolveStatus::Converged {
        Vec::new()
    } else {
        violations.iter().take(MAX_VIOLATIONS).map(|v| describe(programme, v)).collect()
    };
    let warm_start = WarmStart { muscles: problem.muscles, mesh: problem.settings.mesh, point: result.warm_point() };
    SolveOutcome { report, gait, warm_start, violations }
}

fn describe(programme: &GaitProgramme, violation: &RowViolation) -> Violation {
    if let Some(row) = violation.row {
        let name = &programme.rows.names[row];
        let (_, unit, scale) = name.kind.description();
        Violation { row: name.label(), amount: violation.amount * scale, unit: unit.to_owned() }
    } else {
        let variable = violation.variable.unwrap_or(0);
        let (label, unit) = programme.layout.variable_label(variable);
        Violation { row: label, amount: violation.amount * programme.layout.scale[variable], unit: unit.to_owned() }
    }
}
