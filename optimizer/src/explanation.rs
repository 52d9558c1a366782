//! Infeasibility explanations: which tuned bounds conflict, which constraint they make infeasible, and which
//! relaxations of one or several bounds give a gait. All statements are about bounds for which a solve was done.

use crate::gait_problem::GaitProblem;
use crate::solve::{CancelToken, SolveError, SolveOptions, SolveOutcome, SolveStatus, Violation, WarmStart};

mod at_limit;
mod bound;
mod conflict;
mod explanation_sentences;
mod findings;
mod given_bound;
mod relaxation;
mod search;
mod solves;

pub use explanation_sentences::{quantity, status_in_words};
pub use findings::{BoundAtLimit, Conflict, Explanation};
pub use given_bound::BoundValue;
pub use relaxation::{JointRelaxation, Relaxation, RelaxedBound};
use search::search_into;
use solves::SearchEnd;

/// The end of a solve without a gait.
#[derive(Debug, Clone, Copy)]
pub struct SolveWithoutGait<'a> {
    /// Status of the solve.
    pub status: SolveStatus,
    /// Violations of its last iterate, worst first.
    pub violations: &'a [Violation],
    /// Its last iterate.
    pub last: &'a WarmStart,
}

impl<'a> From<&'a SolveOutcome> for SolveWithoutGait<'a> {
    fn from(outcome: &'a SolveOutcome) -> Self {
        Self { status: outcome.report.status, violations: &outcome.violations, last: &outcome.warm_start }
    }
}

/// Explains a solve that did not converge: finds an irreducible conflict among its tuned bounds, and the smallest
/// relaxations that give a gait, by solves with other bounds.
///
/// It takes dozens of solves; `progress` receives each step. If it is cancelled, it returns what it has found
/// ([`Explanation::stopped_early`]), and `None` before the first conflict. `None` if the solve converged or was cancelled.
///
/// # Errors
/// [`SolveError`] if the problem is invalid or the last iterate belongs to another problem.
pub fn explain(
    problem: &GaitProblem,
    unsolved: SolveWithoutGait<'_>,
    options: &SolveOptions,
    progress: &mut dyn FnMut(&str),
    cancel: &CancelToken,
) -> Result<Option<Explanation>, SolveError> {
    if matches!(unsolved.status, SolveStatus::Converged | SolveStatus::Cancelled) {
        return Ok(None);
    }
    let SolveWithoutGait { status, violations, last } = unsolved;
    let mut explanation = Explanation {
        status,
        violations: violations.to_vec(),
        conflicts: Vec::new(),
        gait_found: false,
        at_limit: Vec::new(),
        relaxations: Vec::new(),
        together: Vec::new(),
        stopped_early: false,
        missed: None,
    };
    match search_into(&mut explanation, problem, last, options, progress, cancel) {
        Ok(()) => {}
        Err(SearchEnd::Cancelled) if explanation.conflicts.is_empty() => return Ok(None),
        Err(SearchEnd::Cancelled) => explanation.stopped_early = true,
        Err(SearchEnd::Failed(error)) => return Err(error),
    }
    explanation.relaxations.sort_by(|a, b| a.size().total_cmp(&b.size()));
    explanation.together.sort_by(|a, b| a.size().total_cmp(&b.size()));
    Ok(Some(explanation))
}
