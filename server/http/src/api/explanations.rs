//! Explanations: which bound must give way where a trial has no gait.

use super::jobs::Job;
use crate::AppState;
use crate::may::May;
use crate::once::Once;
use crate::problem::Refusal;
use crate::reached::Id;
use crate::shown::Shown;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gait_optimizer::explanation::{BoundAtLimit, Conflict, JointRelaxation, Relaxation};
use gait_optimizer::{SolveStatus, Violation};
use gaitwright_service::access::{Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::explanation::{self, ExplanationState};
use gaitwright_service::studies::job::{JobId, JobKind};
use gaitwright_service::studies::job_status;
use gaitwright_store::explanations::Explained;
use gaitwright_store::{Instant, TrialId, schema, trials};
use serde::Serialize;
use utoipa::ToSchema;

/// Why a trial has no gait.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct TrialExplanation {
    trial_id: TrialId,
    /// All of it in sentences, as pages and command line say them.
    sentences: Vec<String>,
    /// How its solve ended.
    #[schema(value_type = schema::SolveStatus)]
    status: SolveStatus,
    /// What the last iterate violates, worst first.
    #[schema(value_type = Vec<schema::Violation>)]
    violations: Vec<Violation>,
    /// The tuned bounds that contradict each other; further ones where no single bound resolves the first. Explanations of
    /// earlier versions have none.
    #[schema(value_type = Vec<schema::Conflict>)]
    conflicts: Vec<Conflict>,
    /// The search for a conflict found a gait with the bounds as they are: the solve missed it.
    gait_found: bool,
    /// The tuned bounds that the last iterate runs into.
    #[schema(value_type = Vec<schema::BoundAtLimit>)]
    at_limit: Vec<BoundAtLimit>,
    /// What relaxing each bound of the first conflict alone achieves: the smallest relaxation first, those that do not help
    /// last.
    #[schema(value_type = Vec<schema::Relaxation>)]
    relaxations: Vec<Relaxation>,
    /// What relaxing several together achieves, where no single one helps.
    #[schema(value_type = Vec<schema::JointRelaxation>)]
    together: Vec<JointRelaxation>,
    /// Which version of the program found it out.
    program: String,
    /// SHA-256 of what it was made from: the trial's `problem.json`.
    problem_sha256: String,
    created_at: Instant,
}

impl TrialExplanation {
    fn new(trial_id: TrialId, made: Explained) -> Self {
        let Explained { program, problem_sha256, explanation, created_at } = made;
        Self {
            trial_id,
            sentences: explanation.sentences(),
            status: explanation.status,
            violations: explanation.violations,
            conflicts: explanation.conflicts,
            gait_found: explanation.gait_found,
            at_limit: explanation.at_limit,
            relaxations: explanation.relaxations,
            together: explanation.together,
            program,
            problem_sha256,
            created_at,
        }
    }
}

/// `GET /trials/{id}/explanation`.
#[utoipa::path(
    get,
    path = "/trials/{id}/explanation",
    operation_id = "get_explanation",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial")),
    responses(
        (status = 200, description = "The explanation, as it was made", body = TrialExplanation),
        (status = 409, description = "The trial cannot be explained, or the subject withdrew consent")
    ),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<TrialId, Read>,
) -> Result<Json<TrialExplanation>, Refusal> {
    let mut reader = app.read().await?;
    let trial = trials::get(&mut reader, id).await?;
    match explanation::state(&mut reader, &trial, app.scheduler.explaining(id)).await? {
        ExplanationState::Made(made) => Ok(Json(TrialExplanation::new(id, *made))),
        ExplanationState::Refused(reason) => Err(explanation::refusal(&trial, &reason).into()),
        ExplanationState::BeingMade | ExplanationState::Waiting | ExplanationState::NotAsked => {
            Err(Error::NotFound { what: "explanation of trial".to_owned(), id: id.to_string() }.into())
        }
    }
}

/// `POST /trials/{id}/explanation`: has it made, where it is not there yet.
#[utoipa::path(
    post,
    path = "/trials/{id}/explanation",
    operation_id = "request_explanation",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial; the program solved it, and it did not converge")),
    responses(
        (status = 200, description = "It was made before", body = TrialExplanation),
        (status = 202, description = "The job that makes it, behind all solves, in some minutes", body = Job)
    ),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    once: Once<Run>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let asked = explanation::ask(&mut writer, &once.actor, id, app.scheduler.explaining(id)).await?;
    if let Some(made) = asked {
        return once.done(&app, writer, &TrialExplanation::new(id, made)).await;
    }
    app.scheduler.explain_again(id);
    let id = JobId { kind: JobKind::Explanation, trial: id };
    let job = Job::from(job_status::find(&mut writer, &app.scheduler, id).await?);
    once.accepted(&app, writer, Job::address(id), &job).await
}
