//! REST: infeasibility explanations of trials.

use super::jobs::Job;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::Idempotent;
use crate::problem_details::Refusal;
use crate::resources::explanations::{BoundAtLimit, Conflict, JointRelaxation, Relaxation};
use crate::resources::solve_reports::{SolveStatus, Violation};
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::job::JobId;
use gaitwright_service::studies::explanation::{self, ExplanationState};
use gaitwright_store::explanations::StoredExplanation;
use gaitwright_store::{Instant, TrialId, trials};
use serde::Serialize;
use utoipa::ToSchema;

/// Infeasibility explanation of a trial.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct TrialExplanation {
    /// Explained trial.
    trial_id: TrialId,
    /// The explanation in sentences.
    sentences: Vec<String>,
    /// Status of the solve.
    status: SolveStatus,
    /// Violations of the last iterate, worst first.
    violations: Vec<Violation>,
    /// Conflicts between tuned bounds: the first one, and others if relaxing a single bound does not resolve it. Empty in
    /// older explanations.
    conflicts: Vec<Conflict>,
    /// Whether the search for a conflict found a gait with the given bounds, which the solve had missed.
    gait_found: bool,
    /// Tuned bounds that are active at the last iterate.
    at_limit: Vec<BoundAtLimit>,
    /// Effect of relaxing each bound of the first conflict alone: the smallest relaxation first, ineffective ones last.
    relaxations: Vec<Relaxation>,
    /// Effect of relaxing several bounds together, if no single one helps.
    together: Vec<JointRelaxation>,
    /// Whether the explanation was cancelled after it had found the first conflict. Further conflicts and relaxations may then
    /// be missing; another request makes a complete explanation.
    stopped_early: bool,
    /// Version of the program that made it.
    program: String,
    /// SHA-256 of the trial's `problem.json`.
    problem_sha256: String,
    /// Time of creation.
    created_at: Instant,
}

impl TrialExplanation {
    fn new(trial_id: TrialId, made: StoredExplanation) -> Self {
        let StoredExplanation { program, problem_sha256, explanation, created_at } = made;
        Self {
            trial_id,
            sentences: explanation.sentences(),
            stopped_early: explanation.stopped_early,
            status: explanation.status.into(),
            violations: explanation.violations.into_iter().map(Into::into).collect(),
            conflicts: explanation.conflicts.into_iter().map(Into::into).collect(),
            gait_found: explanation.gait_found,
            at_limit: explanation.at_limit.into_iter().map(Into::into).collect(),
            relaxations: explanation.relaxations.into_iter().map(Into::into).collect(),
            together: explanation.together.into_iter().map(Into::into).collect(),
            program,
            problem_sha256,
            created_at,
        }
    }
}

/// Get the infeasibility explanation of a trial
///
/// Names the bounds that conflict, and relaxations that give a gait.
#[utoipa::path(
    get,
    path = "/trials/{id}/explanation",
    operation_id = "get_explanation",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses(
        (status = 200, description = "Explanation", body = TrialExplanation),
        (status = 409, description = "The trial cannot be explained, or the subject withdrew consent")
    ),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
) -> Result<Json<TrialExplanation>, Refusal> {
    let mut reader = app.read().await?;
    let trial = trials::get(&mut reader, id).await?;
    match explanation::state(&mut reader, &trial, app.scheduler.explaining(id)).await? {
        ExplanationState::Made(made) => Ok(Json(TrialExplanation::new(id, *made))),
        ExplanationState::Refused(reason) => Err(explanation::refusal(&trial, &reason).into()),
        ExplanationState::BeingMade | ExplanationState::Waiting | ExplanationState::NotAsked => {
            Err(Error::NotFound { what: "explanation for trial".to_owned(), id: id.to_string() }.into())
        }
    }
}

/// Request the explanation of a trial
///
/// The trial must have been solved by the service and not have converged.
#[utoipa::path(
    post,
    path = "/trials/{id}/explanation",
    operation_id = "request_explanation",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses(
        (status = 200, description = "Finished job for the existing, complete explanation", body = Job),
        (status = 202, description = "Job that computes the explanation. It takes a few minutes and has lower priority than solves", body = Job)
    ),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    request: Idempotent<Run>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    if !explanation::ask(&mut writer, &request.actor, id, app.scheduler.explaining(id)).await? {
        app.scheduler.explain_again(id);
    }
    Job::respond(&request, &app, writer, JobId::Explanation(id)).await
}
