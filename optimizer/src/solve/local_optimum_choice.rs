//! Which of several local optima is the outcome of a solve.

use super::options::LocalOptimumChoice;
use super::solve_report::SolveStatus;
use super::solver_runs::{Candidate, FinishedRun};

/// Index of the outcome: a cancelled run, otherwise a converged one by `choice`, otherwise the one with the
/// smallest violation. Among the latter, stationary points of the violation come first, because they show which
/// constraints conflict.
pub(super) fn choose(tried: &[FinishedRun], choice: LocalOptimumChoice) -> usize {
    if let Some(cancelled) = tried.iter().position(|t| t.candidate.status == SolveStatus::Cancelled) {
        return cancelled;
    }
    let converged = || tried.iter().enumerate().filter(|(_, t)| t.candidate.status == SolveStatus::Converged);
    let least = |key: &dyn Fn(&Candidate) -> f64, limit: f64| {
        converged()
            .filter(|(_, t)| t.candidate.objective <= limit)
            .min_by(|a, b| key(&a.1.candidate).total_cmp(&key(&b.1.candidate)))
            .map(|(index, t)| (index, t.candidate.objective))
    };
    let Some((lowest, objective)) = least(&|c| c.objective, f64::INFINITY) else {
        let gave_up = |t: &FinishedRun| t.candidate.status != SolveStatus::Infeasible;
        let violation = |t: &FinishedRun| t.candidate.violation;
        return tried
            .iter()
            .enumerate()
            .min_by(|(_, a), (_, b)| gave_up(a).cmp(&gave_up(b)).then(violation(a).total_cmp(&violation(b))))
            .map_or(0, |(index, _)| index);
    };
    match choice {
        LocalOptimumChoice::LowestObjective => lowest,
        LocalOptimumChoice::NearestToReference { within_percent } => {
            least(&|c| c.rmse, objective + 0.01 * within_percent * objective.abs()).map_or(lowest, |(index, _)| index)
        }
    }
}
