//! Trials and their attempts.

use super::solve_reports::{SolveReport, SolveStatus, Violation};
use gait_learner::ActionIndex;
use gait_optimizer::TunedBounds;
use gaitwright_service::studies::study_plan_schemas;
use gaitwright_store::trials::{self, TrialState};
use gaitwright_store::{Instant, StudyId, TrialId, attempts};
use serde::Serialize;
use utoipa::ToSchema;

/// Trial of a study.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Trial {
    /// Identifier.
    id: TrialId,
    /// Identifier of the study to which the trial belongs.
    study_id: StudyId,
    /// Number within the study, from 1, in the order of proposal.
    number: u32,
    /// Index of the action in the search space.
    #[schema(value_type = u64)]
    action_index: ActionIndex,
    /// The action: the values of all bounds, tuned or fixed.
    #[schema(value_type = study_plan_schemas::BoundsSchema)]
    action: TunedBounds,
    /// Reason for the trial.
    reason: String,
    /// Best trial when this one was proposed. Null if there was none.
    best_before: Option<TrialId>,
    /// Trial whose gait is the warm start. Null for a cold start.
    warm_started_from: Option<TrialId>,
    /// Script that evaluates the trial. Null if the service does.
    script: Option<String>,
    /// State of the trial.
    state: TrialState,
    /// How the solve ended. Null without a completed solve.
    status: Option<SolveStatus>,
    /// Gait RMSE of the gait, rad. Null if the trial has no gait, or if the script
    /// that evaluated it did not report the value. If the trial did not converge, `report` has the Gait RMSE of the last iterate.
    gait_rmse_rad: Option<f64>,
    /// Cost of transport of the gait, dimensionless. Null if the trial has no gait, or if the
    /// script that evaluated it did not report the value.
    cost_of_transport: Option<f64>,
    /// Mean strides of the simulated walks on which the result of the trial depends. Null if the trial has no gait, or if
    /// the results of the study do not depend on simulated walks.
    mean_strides: Option<f64>,
    /// Objective of the solve. Null without a completed solve.
    objective: Option<f64>,
    /// Largest violation, scaled. Null without a completed solve.
    max_violation: Option<f64>,
    /// Number of interior-point iterations. Null without a completed solve.
    iterations: Option<u32>,
    /// Wall time of the solve, s. Null without a completed solve.
    seconds_total: Option<f64>,
    /// All numerical results of the solve. Null without a completed solve.
    report: Option<SolveReport>,
    /// Most violated constraints, worst first.
    violations: Vec<Violation>,
    /// Human-readable message about how the trial ended; may be empty.
    message: String,
    /// Time of proposal.
    created_at: Instant,
    /// Time at which a worker first started it. Null before.
    started_at: Option<Instant>,
    /// Time at which it ended. Null while it is open.
    finished_at: Option<Instant>,
}

impl From<trials::Trial> for Trial {
    fn from(row: trials::Trial) -> Self {
        let trials::Trial {
            id,
            study_id,
            number,
            action_index,
            action,
            reason,
            best_before,
            warm_started_from,
            script,
            state,
            status,
            gait_rmse_rad,
            cost_of_transport,
            mean_strides,
            objective,
            max_violation,
            iterations,
            seconds_total,
            report,
            violations,
            message,
            created_at,
            started_at,
            finished_at,
        } = row;
        Self {
            id,
            study_id,
            number,
            action_index,
            action,
            reason,
            best_before,
            warm_started_from,
            script,
            state,
            status: status.map(Into::into),
            gait_rmse_rad,
            cost_of_transport,
            mean_strides,
            objective,
            max_violation,
            iterations,
            seconds_total,
            report: report.map(Into::into),
            violations: violations.into_iter().map(Into::into).collect(),
            message,
            created_at,
            started_at,
            finished_at,
        }
    }
}

/// Numbers of trials of a study by state.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct TrialCounts {
    /// All trials.
    total: u32,
    /// Queued or running trials.
    open: u32,
    /// Converged trials.
    converged: u32,
    /// Trials that did not converge.
    not_converged: u32,
    /// Trials with a gait that is not executable.
    not_executable: u32,
    /// Failed, lost or cancelled trials.
    without_result: u32,
}

impl From<trials::TrialCounts> for TrialCounts {
    fn from(counts: trials::TrialCounts) -> Self {
        let trials::TrialCounts { total, open, converged, not_converged, not_executable, without_result } = counts;
        Self { total, open, converged, not_converged, not_executable, without_result }
    }
}

/// Result of an attempt.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct AttemptResult {
    /// Number of the attempt, from 1.
    attempt: u32,
    /// Name of the worker.
    worker: String,
    /// Whether it became the result of the trial. Otherwise it arrived too late and is kept as evidence.
    used: bool,
    /// How the solve ended.
    status: SolveStatus,
    /// Numerical results of the solve, without those that are not finite.
    report: Option<SolveReport>,
    /// Time of arrival.
    received_at: Instant,
}

impl From<attempts::AttemptResult> for AttemptResult {
    fn from(row: attempts::AttemptResult) -> Self {
        let attempts::AttemptResult { attempt, worker, used, status, report, received_at } = row;
        Self { attempt, worker, used, status: status.into(), report: report.map(Into::into), received_at }
    }
}
