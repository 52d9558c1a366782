//! The local optima among the runs of a solve, and the one that is the outcome.

use super::local_optimum_choice::LocalOptimumChoice;
use super::solve_report::SolveStatus;
use super::solver_runs::{Candidate, FinishedRun};

/// Largest differences of objective and Gait RMSE within a local optimum, at the tolerance of a solve.
const SAME_OBJECTIVE: f64 = 1e-4;
const SAME_RMSE_RAD: f64 = 5e-3;

/// Numbers the local optima of the runs. Runs with the same objective and Gait RMSE share a local optimum.
pub(super) fn number_local_optima(tried: &mut [FinishedRun]) {
    let mut known: Vec<(f64, f64)> = Vec::new();
    for run in tried.iter_mut().map(|t| &mut t.run).filter(|a| a.status == SolveStatus::Converged) {
        let (objective, rmse) = (run.objective, run.gait_rmse_rad);
        let same = |&(other, other_rmse): &(f64, f64)| {
            (objective - other).abs() <= SAME_OBJECTIVE * other.abs() && (rmse - other_rmse).abs() <= SAME_RMSE_RAD
        };
        let number = known.iter().position(same).unwrap_or_else(|| {
            known.push((objective, rmse));
            known.len() - 1
        });
        run.local_optimum = Some(number + 1);
    }
}

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
