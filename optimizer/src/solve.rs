//! Solving a gait problem: solver runs from initial guesses or a warm start, and the outcome.

use crate::gait_problem::GaitProblem;
use crate::model_error::ModelError;
use std::time::Instant;

mod bounds_between_nodes;
mod cold_start_guesses;
mod error;
mod gait_results;
mod local_optima;
mod local_optimum_choice;
mod multi_start;
mod options;
mod phases;
mod progress;
mod solve_outcome;
mod solve_report;
mod solver_runs;
mod solver_settings;
mod time_limit;
mod warm_start;

pub use crate::cancel_token::CancelToken;
use bounds_between_nodes::enforce_between_nodes;
pub use cold_start_guesses::{CostStrategy, GuessTiming, InitialGuess, MuscleRoute};
pub use error::SolveError;
pub use gait_results::GaitResults;
use local_optima::number_local_optima;
use local_optimum_choice::{after_warm_start, choose, refuse_missing};
use multi_start::{try_guesses, try_multi_start};
pub use options::{LocalOptimumChoice, SolveOptions};
use phases::SolveContext;
pub(crate) use phases::final_settings;
pub use progress::{IterationRecord, SolvePhase};
use solve_outcome::{SolveTally, other_local_optimum, outcome};
pub use solve_report::{
    CONVERGED_VIOLATION, LinearAlgebra, Optimality, OtherLocalOptimum, SolveOutcome, SolveReport, SolveStatus,
    SolverRun, StartedFrom, Violation,
};
use solver_runs::{FinishedRun, try_warm};
pub use warm_start::WarmStart;
pub(crate) use warm_start::check_shape;
use warm_start::on_mesh_of;

/// Solves a gait problem. Without a time limit ([`SolveOptions::time_limit_s`]), equal inputs give equal bits.
///
/// A cold start solves from [`SolveOptions::initial_guesses`] initial guesses and chooses a gait by
/// [`SolveOptions::local_optimum_choice`]. If none converges, it tries further guesses until one does
/// ([`SolveOptions::retry`]). If a warm start does not converge, a cold start follows. Without a converged run,
/// the outcome is the run with the smallest violation. If the gait violates bounds between its nodes, the solve
/// continues with tightened bounds ([`SolveOptions::tightening_rounds`]). `observer` is called once per iteration, on
/// the calling thread.
///
/// A solve without a gait is an `Ok` outcome with a status other than `Converged`.
///
/// # Errors
/// [`SolveError`] if the input is invalid.
pub fn solve(
    problem: &GaitProblem,
    warm_start: Option<&WarmStart>,
    options: &SolveOptions,
    observer: &mut dyn FnMut(&IterationRecord),
    cancel: &CancelToken,
) -> Result<SolveOutcome, SolveError> {
    options.validate()?;
    let program = problem.program(problem.muscles)?;
    let start = warm_start.map(|warm| on_mesh_of(problem, &program, warm)).transpose()?;
    let context = SolveContext { problem, program: &program, options, cancel, started: Instant::now() };
    let mut tried = Vec::new();
    if let Some(start) = start {
        tried.push(try_warm(&context, start, observer)?);
    }
    if !tried.iter().any(FinishedRun::is_final) {
        tried.extend(try_multi_start(&context, observer)?);
    }
    number_local_optima(&mut tried);
    let choice = match warm_start {
        None => options.local_optimum_choice,
        Some(_) => after_warm_start(options.local_optimum_choice),
    };
    refuse_missing(&tried, choice)?;
    let chosen = choose(&tried, choice);
    let started_from = match (warm_start, chosen) {
        (None, _) => StartedFrom::Cold,
        (Some(_), 0) => StartedFrom::Warm,
        (Some(_), _) => StartedFrom::ColdAfterWarm,
    };
    let chosen = enforce_between_nodes(&context, &mut tried, chosen, observer)?;
    finish(&context, tried, chosen, started_from)
}

/// Solves a gait problem from a warm start only, without checks between nodes.
///
/// # Errors
/// [`SolveError`] if the input is invalid or the warm start belongs to another problem.
pub(crate) fn solve_from_warm_start(
    problem: &GaitProblem,
    warm_start: &WarmStart,
    options: &SolveOptions,
    cancel: &CancelToken,
) -> Result<SolveOutcome, SolveError> {
    options.validate()?;
    let program = problem.program(problem.muscles)?;
    let start = on_mesh_of(problem, &program, warm_start)?;
    let context = SolveContext { problem, program: &program, options, cancel, started: Instant::now() };
    let tried = try_warm(&context, start, &mut |_| {})?;
    finish(&context, vec![tried], 0, StartedFrom::Warm)
}

/// Solves a gait problem from the given initial guesses only, without checks between nodes: for studies of local
/// optima and of the solver.
///
/// # Errors
/// [`SolveError`] if the input is invalid or there is no guess.
pub fn solve_from_guesses(
    problem: &GaitProblem,
    guesses: &[InitialGuess],
    options: &SolveOptions,
    observer: &mut dyn FnMut(&IterationRecord),
    cancel: &CancelToken,
) -> Result<SolveOutcome, SolveError> {
    options.validate()?;
    for guess in guesses {
        guess.validate()?;
    }
    ModelError::check_range("number of guesses", guesses.len() as f64, 1.0, 1e3)?;
    let program = problem.program(problem.muscles)?;
    let context = SolveContext { problem, program: &program, options, cancel, started: Instant::now() };
    let mut tried = try_guesses(&context, guesses, 0, observer)?;
    number_local_optima(&mut tried);
    refuse_missing(&tried, options.local_optimum_choice)?;
    let chosen = choose(&tried, options.local_optimum_choice);
    finish(&context, tried, chosen, StartedFrom::Cold)
}

/// The outcome of the runs.
fn finish(
    context: &SolveContext<'_>,
    tried: Vec<FinishedRun>,
    chosen: usize,
    started_from: StartedFrom,
) -> Result<SolveOutcome, SolveError> {
    let mut tally = SolveTally::default();
    let (mut answer, mut others) = (None, Vec::<OtherLocalOptimum>::new());
    let chosen_local_optimum = tried.get(chosen).and_then(|one| one.run.local_optimum);
    for (index, mut one) in tried.into_iter().enumerate() {
        one.run.chosen = index == chosen;
        tally.iterations += one.run.iterations;
        tally.evaluation_s += one.evaluation_s;
        tally.linear_algebra.add(&one.linear_algebra);
        if index == chosen {
            answer = Some((one.candidate, one.margins));
        } else if let Some(local_optimum) =
            one.run.local_optimum.filter(|local_optimum| Some(*local_optimum) != chosen_local_optimum)
            && others.iter().all(|other| other.local_optimum != local_optimum)
        {
            others.push(other_local_optimum(context, one.candidate, &one.run, local_optimum));
        }
        tally.solver_runs.push(one.run);
    }
    let Some((candidate, margins)) = answer else {
        let field = "number of guesses".to_owned();
        let (minimum, maximum, unit, relation) = (1.0, 1e3, "", String::new());
        return Err(ModelError::OutOfRange { field, value: 0.0, minimum, maximum, unit, relation }.into());
    };
    let outcome = outcome(context, candidate, &margins, tally, started_from);
    Ok(SolveOutcome { other_local_optima: others, ..outcome })
}
