//! The interface between the service and infeasibility explanations.

use gait_optimizer::explanation::{Explanation, SolveWithoutGait, explain};
use gait_optimizer::{CancelToken, GaitProblem, SolveError, SolveOptions, SolveStatus, Violation, WarmStart};

/// A solve that ended without a gait.
#[derive(Debug, Clone)]
pub struct SolveToExplain {
    /// The gait problem.
    pub problem: GaitProblem,
    /// Settings and limits of the solver.
    pub options: SolveOptions,
    /// Status of the solve.
    pub status: SolveStatus,
    /// Violations of its last iterate, worst first.
    pub violations: Vec<Violation>,
    /// Its last iterate.
    pub last: WarmStart,
}

/// Explains a solve without a gait on the calling thread.
pub trait Explain: Send + Sync + 'static {
    /// The explanation. The same solve gives the same one, bit for bit. `None` if cancelled, within one iteration.
    ///
    /// # Errors
    /// [`SolveError`] if the last iterate does not belong to the problem.
    fn explain(&self, solve: &SolveToExplain, cancel: &CancelToken) -> Result<Option<Explanation>, SolveError>;
}

/// Explains with `gait_optimizer::explanation::explain`.
#[derive(Debug, Clone, Copy, Default)]
pub struct GaitExplainer;

impl Explain for GaitExplainer {
    fn explain(&self, solve: &SolveToExplain, cancel: &CancelToken) -> Result<Option<Explanation>, SolveError> {
        let SolveToExplain { problem, options, status, violations, last } = solve;
        // This low-priority thread has no time limit, because elapsed time says nothing about the problem.
        let options = SolveOptions { threads: 1, time_limit_s: None, ..*options };
        explain(problem, SolveWithoutGait { status: *status, violations, last }, &options, &mut |_| {}, cancel)
    }
}
