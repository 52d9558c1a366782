//! The local optima among the runs of a solve.

use super::solve_report::SolveStatus;
use super::solver_runs::FinishedRun;

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
