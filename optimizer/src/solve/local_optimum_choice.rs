//! Which of several local optima is the outcome of a solve.

use super::error::SolveError;
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
        LocalOptimumChoice::Numbered { number } => {
            let local_optimum = |(_, t): &(usize, &FinishedRun)| t.run.local_optimum == Some(number);
            converged().find(local_optimum).map_or(lowest, |(index, _)| index)
        }
        LocalOptimumChoice::NearestToReference { within_percent } => {
            least(&|c| c.rmse, objective + 0.01 * within_percent * objective.abs()).map_or(lowest, |(index, _)| index)
        }
    }
}

/// The choice of a solve with a warm start: numbers belong to cold starts.
pub(super) fn after_warm_start(choice: LocalOptimumChoice) -> LocalOptimumChoice {
    match choice {
        LocalOptimumChoice::Numbered { .. } => LocalOptimumChoice::LowestObjective,
        other => other,
    }
}

/// Refuses runs that reached gaits, but not the local optimum that was asked for.
pub(super) fn refuse_missing(tried: &[FinishedRun], choice: LocalOptimumChoice) -> Result<(), SolveError> {
    let LocalOptimumChoice::Numbered { number } = choice else { return Ok(()) };
    let is_cancelled = tried.iter().any(|t| t.candidate.status == SolveStatus::Cancelled);
    let reached = tried.iter().filter_map(|t| t.run.local_optimum).max();
    match reached {
        Some(reached) if number > reached && !is_cancelled => Err(SolveError::NoLocalOptimum { number, reached }),
        _ => Ok(()),
    }
}
