//! REST: lab sessions.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::{Idempotent, IdempotentWith};
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::lab_sessions::LabSessionView;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{Administer, Rate, Read, Run};
use gaitwright_service::studies::lab::{self, LabSessionProgress, NewAnswer, NewLabSession, RecordedWalk};
use gaitwright_store::lab_sessions::LabSession;
use gaitwright_store::{LabSessionId, StudyId, lab_sessions, studies};
use serde::Deserialize;
use utoipa::ToSchema;

/// The session as clients see it.
fn view(session: &LabSession) -> LabSessionView {
    lab::LabSessionView::from(session).into()
}

/// List lab sessions of a study
///
/// The response omits blinded data. Sorted by number.
#[utoipa::path(
    get,
    path = "/studies/{id}/lab-sessions",
    operation_id = "list_lab_sessions",
    tag = "lab",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "Lab sessions, sorted by number", body = Page<LabSessionView>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    paging: Paging<u32>,
) -> Result<Json<Page<LabSessionView>>, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let all = lab_sessions::of_study(&mut reader, id).await?;
    Ok(Json(paging.cut(all, |session| session.number)?.map(|session| view(&session))))
}

/// Create a lab session
///
/// The session consists of a walk without the device, then one with each gait. The order of the gaits is drawn at random
/// when the session is planned, and concealed.
#[utoipa::path(
    post,
    path = "/studies/{id}/lab-sessions",
    operation_id = "create_lab_session",
    tag = "lab",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    request_body = NewLabSession,
    responses((status = 201, description = "Lab session", body = LabSessionView)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    IdempotentWith(request, new): IdempotentWith<Run, NewLabSession>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let session = lab::plan(&mut writer, &request.actor, id, &new).await?;
    let location = format!("/api/v1/lab-sessions/{}", session.id);
    request.created(&app, writer, location, &view(&session)).await
}

/// Get a lab session
///
/// The response omits blinded data.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}",
    operation_id = "get_lab_session",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    responses((status = 200, description = "Lab session", body = LabSessionView), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<LabSessionId, Read>,
) -> Result<Json<LabSessionView>, Refusal> {
    Ok(Json(view(&lab_sessions::get(&mut *app.read().await?, id).await?)))
}

/// Request to close a lab session.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct LabSessionClosing {
    /// Note, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    note: String,
}

/// Close a lab session
///
/// A closed session accepts no more data except safety reports.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/close",
    operation_id = "close_lab_session",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    request_body = LabSessionClosing,
    responses((status = 200, description = "Closed session", body = LabSessionView)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn close(
    State(app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    IdempotentWith(request, closing): IdempotentWith<Run, LabSessionClosing>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let session = lab::close(&mut writer, &request.actor, id, &closing.note).await?;
    request.done(&app, writer, &view(&session)).await
}

/// Request to unblind a lab session.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct LabSessionUnblinding {
    /// Reason, 1 to 2000 characters.
    #[schema(min_length = 1, max_length = 2000)]
    reason: String,
}

/// Unblind a lab session
///
/// Reveals to everyone who can access the study which gait each walk used. The audit trail records the unblinding,
/// later walks are marked as recorded after it, and the answer of the subject becomes a preference of the study.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/unblind",
    operation_id = "unblind_lab_session",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    request_body = LabSessionUnblinding,
    responses((status = 200, description = "Session with the condition of each walk", body = LabSessionView)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn unblind(
    State(app): State<AppState>,
    Id(id, _): Id<LabSessionId, Administer>,
    IdempotentWith(request, asked): IdempotentWith<Administer, LabSessionUnblinding>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let session = lab::unblind(&mut writer, &request.actor, id, &asked.reason).await?;
    request.done(&app, writer, &view(&session)).await
}

/// Get the next walk of a lab session
///
/// The response omits all data that would reveal a gait.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/next-walk",
    operation_id = "get_next_walk",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    responses((status = 200, description = "Next walk", body = LabSessionProgress), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["rate"]), ("session" = ["rate"])),
)]
pub(super) async fn session_progress(
    _: Authorized<Rate>,
    State(app): State<AppState>,
    Id(id, _): Id<LabSessionId, Rate>,
) -> Result<Json<LabSessionProgress>, Refusal> {
    Ok(Json(lab::session_progress(&mut *app.read().await?, id).await?))
}

/// Record a walk
///
/// Walks are recorded in order. Recording a walk cannot be undone.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/walks",
    operation_id = "record_walk",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    request_body = RecordedWalk,
    responses((status = 200, description = "Next walk", body = LabSessionProgress)),
    security(("token" = ["rate"]), ("session" = ["rate"])),
)]
pub(super) async fn walk(
    State(app): State<AppState>,
    Id(id, _): Id<LabSessionId, Rate>,
    IdempotentWith(request, walked): IdempotentWith<Rate, RecordedWalk>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let next = lab::record_walk(&mut writer, &request.actor, id, &walked).await?;
    request.done(&app, writer, &next).await
}

/// Answer a lab session
///
/// States which walk was better, that there is no difference, that the subject cannot tell, or that a walk was unsafe. The
/// answer reaches the learner at unblinding; a safety report takes effect at once.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/answers",
    operation_id = "answer_lab_session",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    request_body = NewAnswer,
    responses((status = 200, description = "Session with the answer", body = LabSessionProgress)),
    security(("token" = ["rate"]), ("session" = ["rate"])),
)]
pub(super) async fn answer(
    State(app): State<AppState>,
    Id(id, _): Id<LabSessionId, Rate>,
    IdempotentWith(request, new): IdempotentWith<Rate, NewAnswer>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let seen = lab::answer(&mut writer, &request.caller, id, &new).await?;
    request.done(&app, writer, &seen).await
}

/// Retract the answer of the subject
///
/// Possible until the session is closed or unblinded. A safety report cannot be retracted.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/retract-answer",
    operation_id = "retract_lab_answer",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    responses((status = 200, description = "Session without an answer", body = LabSessionProgress)),
    security(("token" = ["rate"]), ("session" = ["rate"])),
)]
pub(super) async fn retract(
    State(app): State<AppState>,
    Id(id, _): Id<LabSessionId, Rate>,
    request: Idempotent<Rate>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let seen = lab::retract(&mut writer, &request.caller, id).await?;
    request.done(&app, writer, &seen).await
}
