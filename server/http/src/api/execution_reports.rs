//! REST: execution reports of gaits.

use super::jobs::Job;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::IdempotentWith;
use crate::problem_details::Refusal;
use crate::resources::execution_reports::ExecutionReport;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::job::JobId;
use gaitwright_service::studies::execution::{self, NewExecutionReport};
use gaitwright_service::studies::execution_request;
use gaitwright_store::execution_reports::{ExecutionReported, StoredReport};
use gaitwright_store::{Instant, TrialId};
use serde::Serialize;
use utoipa::ToSchema;

/// Execution report of a gait.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct TrialExecutionReport {
    /// Trial of the gait.
    trial_id: TrialId,
    /// How many simulated walks were complete, as a sentence.
    sentence: String,
    /// The report, as `gaitwright simulate --json` prints it.
    report: ExecutionReport,
    /// Version of the program that made it.
    program: String,
    /// Time of creation.
    created_at: Instant,
}

impl From<StoredReport> for TrialExecutionReport {
    fn from(kept: StoredReport) -> Self {
        let StoredReport { reported: ExecutionReported { trial_id, program, report, .. }, created_at } = kept;
        Self { trial_id, sentence: report.sentence(), report: report.into(), program, created_at }
    }
}

/// Get the execution report of a trial
///
/// The newest report of simulated walks with the gait. The simulation does not use the optimiser's model.
#[utoipa::path(
    get,
    path = "/trials/{id}/execution-report",
    operation_id = "get_execution_report",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses((status = 200, description = "Execution report", body = TrialExecutionReport), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
) -> Result<Json<TrialExecutionReport>, Refusal> {
    let missing = || Error::NotFound { what: "execution report for trial".to_owned(), id: id.to_string() };
    let kept = execution::newest(&mut *app.read().await?, id).await?.ok_or_else(missing)?;
    Ok(Json(kept.into()))
}

/// Request the execution report of a trial
///
/// The gait of the trial must have converged. Walks on level ground, and on ground uneven by ±5 mm and by ±10 mm, are
/// simulated. The same number of simulated walks and seed give the same report.
#[utoipa::path(
    post,
    path = "/trials/{id}/execution-report",
    operation_id = "request_execution_report",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    request_body = NewExecutionReport,
    responses(
        (status = 200, description = "Finished job, if the newest report has this number of simulated walks and this seed", body = Job),
        (status = 202, description = "Job that simulates the walks, with lower priority than solves", body = Job)
    ),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    IdempotentWith(request, asked): IdempotentWith<Run, NewExecutionReport>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    execution_request::ask(&mut writer, &app.scheduler, &request.actor, id, asked).await?;
    Job::respond(&request, &app, writer, JobId::ExecutionReport(id)).await
}
