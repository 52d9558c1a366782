//! Suggestions: what would have been better than a trial.

use crate::AppState;
use crate::extract::Params;
use crate::may::May;
use crate::once::OnceWith;
use crate::pages_of::{After, linked_after};
use crate::problem::Refusal;
use crate::reached::Id;
use crate::shown::Shown;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use gaitwright_service::access::{self, Read};
use gaitwright_service::studies::suggestion::{self, Suggestion};
use gaitwright_store::feedback::{self, FeedbackRow};
use gaitwright_store::{StudyId, studies};

/// `GET /studies/{id}/suggestions`: as given, those that were taken back included, by pages; the `Link` header has the
/// address of the next one.
#[utoipa::path(
    get,
    path = "/studies/{id}/suggestions",
    operation_id = "list_suggestions",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "The study"), ("after" = Option<i64>, Query, description = "After this `seq`"), ("limit" = Option<u32>, Query, description = "At most so many: 1 to 1000")),
    responses((status = 200, description = "A page, by time", body = Vec<FeedbackRow>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<StudyId, Read>,
    Params(page): Params<After<i64>>,
) -> Result<Response, Refusal> {
    let limit = page.limit(1000)?;
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let rows = feedback::suggestions(&mut reader, id, page.after.unwrap_or(0), limit + 1).await?;
    Ok(linked_after(&format!("/api/v1/studies/{id}/suggestions"), rows, limit, |row| row.seq.to_string()))
}

/// `POST /studies/{id}/suggestions`. The learner hears it like an answer; it is taken back like one
/// (`POST /preferences/{id}/retract`).
#[utoipa::path(
    post,
    path = "/studies/{id}/suggestions",
    operation_id = "create_suggestion",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "The study")),
    request_body = Suggestion,
    responses((status = 201, description = "Recorded", body = FeedbackRow)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, access::Answer>,
    OnceWith(once, new): OnceWith<access::Answer, Suggestion>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let given = suggestion::give(&mut writer, &once.caller, id, &new).await?;
    let row = feedback::get(&mut writer, given).await?;
    let location = format!("/api/v1/preferences/{given}");
    once.finish(&app, writer, StatusCode::CREATED, Some(location), &row).await
}
