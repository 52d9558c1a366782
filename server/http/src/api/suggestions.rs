//! REST: suggestions.

use super::preferences::AnswerRetraction;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::IdempotentWith;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::suggestions::Suggestion;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{self, Read};
use gaitwright_service::error::Error;
use gaitwright_service::studies::suggestion::{self, NewSuggestion};
use gaitwright_store::feedback::{self, FeedbackRow};
use gaitwright_store::{Connection, FeedbackId, StudyId, studies};

/// List suggestions of a study
///
/// Includes retracted suggestions. Oldest first.
#[utoipa::path(
    get,
    path = "/studies/{id}/suggestions",
    operation_id = "list_suggestions",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "A page, oldest first", body = Page<Suggestion>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    paging: Paging<i64>,
) -> Result<Json<Page<Suggestion>>, Refusal> {
    let mut reader = app.read().await?;
    let space = studies::get(&mut reader, id).await?.plan.search_space;
    let rows = feedback::suggestions(&mut reader, id, paging.after.unwrap_or(0), paging.to_read()).await?;
    let rows = rows.into_iter().map(|row| Suggestion::of(row, &space)).collect::<Result<Vec<_>, _>>()?;
    Ok(Json(paging.page(rows, |row| row.seq)?))
}

/// Create a suggestion
///
/// The learner uses it like a preference.
#[utoipa::path(
    post,
    path = "/studies/{id}/suggestions",
    operation_id = "create_suggestion",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    request_body = NewSuggestion,
    responses((status = 201, description = "Suggestion", body = Suggestion)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, access::Answer>,
    IdempotentWith(request, new): IdempotentWith<access::Answer, NewSuggestion>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let given = suggestion::give(&mut writer, &request.caller, id, &new).await?;
    let row = feedback::get(&mut writer, given).await?;
    let location = format!("/api/v1/suggestions/{given}");
    let shown = of_row(&mut writer, row).await?;
    request.created(&app, writer, location, &shown).await
}

/// Get a suggestion
///
/// Retracted suggestions are returned, too, with their retraction.
#[utoipa::path(
    get,
    path = "/suggestions/{id}",
    operation_id = "get_suggestion",
    tag = "preferences",
    params(("id" = FeedbackId, Path, description = "Identifier of the suggestion")),
    responses((status = 200, description = "Suggestion", body = Suggestion), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<FeedbackId, Read>,
) -> Result<Json<Suggestion>, Refusal> {
    let mut reader = app.read().await?;
    let row = feedback::get(&mut reader, id).await?;
    Ok(Json(of_row(&mut reader, row).await?))
}

/// Retract a suggestion
///
/// The suggestion stays on record, but the learner no longer uses it.
#[utoipa::path(
    post,
    path = "/suggestions/{id}/retract",
    operation_id = "retract_suggestion",
    tag = "preferences",
    params(("id" = FeedbackId, Path, description = "Identifier of the suggestion")),
    request_body = AnswerRetraction,
    responses((status = 200, description = "Retracted suggestion", body = Suggestion)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn retract(
    State(app): State<AppState>,
    Id(id, _): Id<FeedbackId, access::Answer>,
    IdempotentWith(request, why): IdempotentWith<access::Answer, AnswerRetraction>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let row = suggestion::retract(&mut writer, &request.caller, id, why.author.as_deref(), &why.reason).await?;
    let shown = of_row(&mut writer, row).await?;
    request.done(&app, writer, &shown).await
}

async fn of_row(db: &mut Connection, row: FeedbackRow) -> Result<Suggestion, Error> {
    let study = studies::get(db, row.study_id).await?;
    Suggestion::of(row, &study.plan.search_space)
}
