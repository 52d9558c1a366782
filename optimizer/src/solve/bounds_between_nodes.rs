//! Bounds also hold between the nodes: those that a gait violates there are tightened, and the solve continues.

use super::error::SolveError;
use super::phases::{RunInProgress, SolveContext};
use super::progress::{IterationRecord, SolvePhase};
use super::solve_report::SolveStatus;
use super::solver_runs::FinishedRun;
use crate::gait_problem::inter_node_check::inter_node_excess;

/// Tightens the bounds that the chosen gait violates between its nodes and continues the solve, until there is no
/// violation or the rounds are used up. Returns the index of the last converged run, or of a cancelled one.
pub(super) fn enforce_between_nodes(
    context: &SolveContext<'_>,
    tried: &mut Vec<FinishedRun>,
    mut chosen: usize,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<usize, SolveError> {
    for _ in 0..context.options.tightening_rounds {
        let now = &tried[chosen];
        if now.candidate.status != SolveStatus::Converged {
            break;
        }
        let excess = inter_node_excess(context.program, &now.candidate.gait, &now.candidate.result.x);
        if excess.worst <= 1.0 {
            break;
        }
        let mut margins = now.margins.clone();
        margins.grow(&excess.margins);
        let point = now.candidate.result.warm_point();
        let mut run = RunInProgress::new(context, context.options.threads, observer);
        run.guess = tried.len();
        let result = run.warm(SolvePhase::InterNode, &context.program.tightened(&margins), point)?;
        let mut next = FinishedRun::new(context, result, "bounds tightened between nodes", margins, &run);
        next.run.local_optimum =
            tried[chosen].run.local_optimum.filter(|_| next.candidate.status == SolveStatus::Converged);
        let status = next.candidate.status;
        tried.push(next);
        if !matches!(status, SolveStatus::Converged | SolveStatus::Cancelled) {
            break;
        }
        chosen = tried.len() - 1;
    }
    Ok(chosen)
}
