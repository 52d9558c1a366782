//! The seam between the service and the explanation of a solve without a gait.

use gait_optimizer::explanation::{Explanation, Unsolved, explain};
use gait_optimizer::{CancelToken, GaitProblem, SolveError, SolveOptions, SolveStatus, Violation, WarmStart};

/// A solve that ended without a gait.
#[derive(Debug, Clone)]
pub struct Unexplained {
    /// What was solved.
    pub problem: GaitProblem,
    /// Its limits.
    pub options: SolveOptions,
    /// How it ended.
    pub status: SolveStatus,
    /// What its last iterate violates, worst first.
    pub violations: Vec<Violation>,
    /// Its last iterate.
    pub last: WarmStart,
}

/// Explains a solve without a gait on the calling thread.
pub trait Explain: Send + Sync + 'static {
    /// Why there is no gait: the same for the same solve, to the last bit. `None`: cancelled, within one iteration.
    ///
    /// # Errors
    /// [`SolveError`] when what the solve left does not belong to its problem.
    fn explain(&self, solve: &Unexplained, cancel: &CancelToken) -> Result<Option<Explanation>, SolveError>;
}

/// The real thing: `gait_optimizer::explanation::explain`.
#[derive(Debug, Clone, Copy, Default)]
pub struct GaitExplainer;

impl Explain for GaitExplainer {
    fn explain(&self, solve: &Unexplained, cancel: &CancelToken) -> Result<Option<Explanation>, SolveError> {
        let Unexplained { problem, options, status, violations, last } = solve;
        // On one thread, which waits for others: what a clock says of it is not about the problem.
        let options = SolveOptions { threads: 1, time_limit_s: None, ..*options };
        explain(problem, Unsolved { status: *status, violations, last }, &options, &mut |_| {}, cancel)
    }
}
