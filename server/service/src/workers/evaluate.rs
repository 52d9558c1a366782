//! The interface between the workers and the optimizer.

use super::dispatch::Assignment;
use gait_optimizer::{CancelToken, IterationRecord, SolveOutcome, solve};

/// Runs a solve on the calling thread.
pub trait Evaluate: Send + Sync + 'static {
    /// Runs the solve, calling `observer` at every iteration and stopping within one of `cancel`.
    ///
    /// # Errors
    /// A message if the solve could not start, which is an engineering failure.
    fn evaluate(
        &self,
        assignment: &Assignment,
        observer: &mut dyn FnMut(&IterationRecord),
        cancel: &CancelToken,
    ) -> Result<SolveOutcome, String>;
}

/// Solves with `gait_optimizer::solve`.
#[derive(Debug, Clone, Copy, Default)]
pub struct GaitSolver;

impl Evaluate for GaitSolver {
    fn evaluate(
        &self,
        assignment: &Assignment,
        observer: &mut dyn FnMut(&IterationRecord),
        cancel: &CancelToken,
    ) -> Result<SolveOutcome, String> {
        solve(&assignment.problem, assignment.warm_start.as_ref(), &assignment.options, observer, cancel)
            .map_err(|e| e.to_string())
    }
}
