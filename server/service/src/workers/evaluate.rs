//! The seam between the service and the optimizer.

use super::dispatch::Attempt;
use gait_optimizer::{CancelToken, GaitProblem, IterationRecord, SolveOptions, SolveOutcome, WarmStart, solve};
use serde::{Deserialize, Serialize};

/// One solve to run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Assignment {
    /// The trial, and which try at it this is.
    pub attempt: Attempt,
    /// Number of the trial within its study.
    pub number: u32,
    /// What to solve.
    pub problem: GaitProblem,
    /// What to start from; `None`: cold.
    pub warm_start: Option<WarmStart>,
    /// Limits of the solve.
    pub options: SolveOptions,
}

/// Runs a solve on the calling thread.
pub trait Evaluate: Send + Sync + 'static {
    /// Runs the solve, calling `observer` at every iteration and stopping within one of `cancel`.
    ///
    /// # Errors
    /// Text for people when the solve could not even be tried: a failure of the program, not of the action.
    fn evaluate(
        &self,
        assignment: &Assignment,
        observer: &mut dyn FnMut(&IterationRecord),
        cancel: &CancelToken,
    ) -> Result<SolveOutcome, String>;
}

/// The real thing: `gait_optimizer::solve`.
#[derive(Debug, Clone, Copy, Default)]
pub struct GaitSolver;

impl Evaluate for GaitSolver {
    fn evaluate(
        &self,
        assignment: &Assignment,
        observer: &mut dyn FnMut(&IterationRecord),
        cancel: &CancelToken,
    ) -> Result<SolveOutcome, String> {
        let solved = solve(&assignment.problem, assignment.warm_start.as_ref(), &assignment.options, observer, cancel);
        // The record keeps the answer; whoever wants the gaits of other basins solves the trial's problem again.
        solved.map(|outcome| SolveOutcome { other_basins: Vec::new(), ..outcome }).map_err(|e| e.to_string())
    }
}
