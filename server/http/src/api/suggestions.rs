//! REST: suggestions.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::IdempotentWith;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::feedback::Preference;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{self, Read};
use gaitwright_service::studies::suggestion::{self, Suggestion};
use gaitwright_store::{StudyId, feedback, studies};

/// List suggestions of a study
///
/// Includes retracted suggestions. Oldest first.
#[utoipa::path(
    get,
    path = "/studies/{id}/suggestions",
    operation_id = "list_suggestions",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "A page, oldest first", body = Page<Preference>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    paging: Paging<i64>,
) -> Result<Json<Page<Preference>>, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let rows = feedback::suggestions(&mut reader, id, paging.after.unwrap_or(0), paging.to_read()).await?;
    Ok(Json(paging.page(rows, |row| row.seq)?.map(Preference::from)))
}

/// Create a suggestion
///
/// The learner uses it like a preference. Retract it with `POST /api/v1/preferences/{id}/retract`.
#[utoipa::path(
    post,
    path = "/studies/{id}/suggestions",
    operation_id = "create_suggestion",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    request_body = Suggestion,
    responses((status = 201, description = "Suggestion", body = Preference)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, access::Answer>,
    IdempotentWith(request, new): IdempotentWith<access::Answer, Suggestion>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let given = suggestion::give(&mut writer, &request.caller, id, &new).await?;
    let row = feedback::get(&mut writer, given).await?;
    let location = format!("/api/v1/preferences/{given}");
    request.created(&app, writer, location, &Preference::from(row)).await
}
