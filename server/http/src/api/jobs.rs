//! REST: jobs and workers.

use crate::AppState;
use crate::authorization::Authorized;
use crate::idempotent::Idempotent;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::jobs::OpenSolve;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{Read, RequiredRight, Run};
use gaitwright_service::job::{JobId, JobKind, JobState};
use gaitwright_service::studies::job_cancellation;
use gaitwright_service::studies::job_status::{self, JobStatus};
use gaitwright_store::{BorrowedWriter, StudyId, TrialId, solve_jobs};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Background work of the service.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Job {
    /// Identifier.
    #[schema(value_type = String)]
    id: JobId,
    /// Kind of the job.
    kind: JobKind,
    /// State of the job.
    state: JobState,
    /// Trial of the job. Null for a backup.
    trial_id: Option<TrialId>,
    /// Study of the trial. Null for a backup.
    study_id: Option<StudyId>,
    /// URL of the result. Null until the job is done.
    result: Option<String>,
    /// Reason if it failed. Null otherwise.
    reason: Option<String>,
    /// Share of the work that is done, 0 to 1. Known only while walks are simulated; null otherwise.
    progress: Option<f64>,
    /// Attempts and worker of an open solve. Null otherwise.
    solve: Option<OpenSolve>,
}

impl From<JobStatus> for Job {
    fn from(job: JobStatus) -> Self {
        let JobStatus { id, study, state, reason, progress, solve } = job;
        let result = match id {
            JobId::Backup(backup) => format!("/api/v1/backups/{backup}"),
            JobId::Certificate(trial) => format!("/api/v1/trials/{trial}/certificate"),
            JobId::ExecutionReport(trial) => format!("/api/v1/trials/{trial}/execution-report"),
            JobId::Explanation(trial) => format!("/api/v1/trials/{trial}/explanation"),
            JobId::Solve(trial) => format!("/api/v1/trials/{trial}"),
        };
        let result = (state == JobState::Done).then_some(result);
        Self {
            id,
            kind: id.kind(),
            state,
            trial_id: id.trial(),
            study_id: study,
            result,
            reason,
            progress,
            solve: solve.map(Into::into),
        }
    }
}

impl Job {
    /// The address of a job.
    pub(super) fn address(id: JobId) -> String {
        format!("/api/v1/jobs/{id}")
    }

    /// The response to a request for a result: 202, or 200 if the result exists already.
    pub(super) async fn respond<P: RequiredRight>(
        request: &Idempotent<P>,
        app: &AppState,
        mut writer: BorrowedWriter<'_>,
        id: JobId,
    ) -> Result<Response, Refusal> {
        let job = Self::from(job_status::find(&mut writer, app.runners(), id).await?);
        match job.state {
            JobState::Done => request.done(app, writer, &job).await,
            _ => request.accepted(app, writer, Self::address(id), &job).await,
        }
    }
}

/// Filter of jobs.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JobFilter {
    kind: Option<JobKind>,
    study_id: Option<StudyId>,
}

/// List jobs
///
/// Jobs that have not ended: backups, and those of studies that the caller can access. Sorted by kind and age.
#[utoipa::path(
    get,
    path = "/jobs",
    operation_id = "list_jobs",
    tag = "operation",
    params(
        ("kind" = Option<JobKind>, Query, description = "Only jobs of this kind"),
        ("study_id" = Option<StudyId>, Query, description = "Only jobs of this study")
    ),
    responses((status = 200, description = "A page", body = Page<Job>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    authorized: Authorized<Read>,
    State(app): State<AppState>,
    paging: Paging<JobId, JobFilter>,
) -> Result<Json<Page<Job>>, Refusal> {
    let JobFilter { kind, study_id } = paging.filter;
    let mut all = job_status::open(&mut *app.read().await?, app.runners(), authorized.caller.reach()).await?;
    all.retain(|job| {
        kind.is_none_or(|kind| kind == job.id.kind()) && study_id.is_none_or(|study| Some(study) == job.study)
    });
    Ok(Json(paging.cut(all, |job| job.id)?.map(Job::from)))
}

/// Get a job
///
/// Includes jobs that have ended.
#[utoipa::path(
    get,
    path = "/jobs/{id}",
    operation_id = "get_job",
    tag = "operation",
    params(("id" = String, Path, description = "Identifier of the job")),
    responses((status = 200, description = "Job", body = Job), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<JobId, Read>,
) -> Result<Json<Job>, Refusal> {
    Ok(Json(job_status::find(&mut *app.read().await?, app.runners(), id).await?.into()))
}

/// Cancel a job
///
/// A solve stops within one iteration, and its trial is cancelled. Cancelling a backup requires the `administer` right.
#[utoipa::path(
    post,
    path = "/jobs/{id}/cancel",
    operation_id = "cancel_job",
    tag = "operation",
    params(("id" = String, Path, description = "Identifier of the job")),
    responses((status = 200, description = "Cancelled job", body = Job)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn cancel(
    State(app): State<AppState>,
    Visible(id, _): Visible<JobId, Run>,
    request: Idempotent<Run>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let cancelled = job_cancellation::cancel(&mut writer, &request.caller, app.runners(), id).await?;
    let answer = request.done(&app, writer, &Job::from(cancelled)).await?;
    job_cancellation::stop(app.runners(), id).await;
    Ok(answer)
}

/// A worker that runs solves.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Worker {
    /// Name of the worker.
    name: String,
    /// Number of solves that it is running.
    running_solves: u32,
}

/// List workers
///
/// The workers that are running solves. Sorted by name.
#[utoipa::path(
    get,
    path = "/workers",
    operation_id = "list_workers",
    tag = "operation",
    responses((status = 200, description = "A page", body = Page<Worker>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn workers(
    _: Authorized<Read>,
    State(app): State<AppState>,
    paging: Paging<String>,
) -> Result<Json<Page<Worker>>, Refusal> {
    // Names of workers reveal nothing about studies.
    let running = solve_jobs::by_worker(&mut *app.read().await?).await?;
    let all = running.into_iter().map(|(name, running_solves)| Worker { name, running_solves }).collect();
    Ok(Json(paging.cut(all, |worker| worker.name.clone())?))
}
