//! REST: preferences.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::csv_response::csv_response;
use crate::idempotent::IdempotentWith;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::feedback::Preference;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_charts::csv_table::{CsvTable, cells};
use gaitwright_service::access::{self, Read};
use gaitwright_service::studies::preference_answer::{self, Answer};
use gaitwright_store::feedback::{self, FeedbackContent};
use gaitwright_store::{FeedbackId, StudyId, studies};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// List preferences of a study
///
/// Includes retracted preferences. Oldest first.
#[utoipa::path(
    get,
    path = "/studies/{id}/preferences",
    operation_id = "list_preferences",
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
    let rows = feedback::comparisons(&mut reader, id, paging.after.unwrap_or(0), paging.to_read()).await?;
    let rows = rows.into_iter().map(Preference::try_from).collect::<Result<Vec<_>, _>>()?;
    Ok(Json(paging.page(rows, |row| row.seq)?))
}

/// Download preferences as CSV
///
/// In a preference, `trial_a` is the winner.
#[utoipa::path(
    get,
    path = "/studies/{id}/preferences.csv",
    operation_id = "get_preferences_csv",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "All preferences, oldest first", body = String, content_type = "text/csv"), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study_csv(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let rows = feedback::comparisons(&mut reader, id, 0, u32::MAX).await?;
    drop(reader);
    csv_response(&mut app, &format!("preferences-{}.csv", id.short()), move || table(&rows)).await
}

fn table(rows: &[feedback::FeedbackRow]) -> CsvTable {
    let mut table = CsvTable::new([
        "seq",
        "id",
        "kind",
        "trial_a",
        "trial_b",
        "source",
        "author",
        "note",
        "created_at",
        "retracted_at",
        "retraction_reason",
        "replaces",
        "restores",
    ]);
    for row in rows {
        let (kind, a, b) = match row.content {
            FeedbackContent::Preference { winner, loser } => ("preference", winner, loser),
            FeedbackContent::NoDifference { a, b } => ("no_difference", a, b),
            FeedbackContent::Label { .. } | FeedbackContent::Suggestion { .. } => continue,
        };
        let retraction = row.retraction.as_ref();
        table.row(cells![
            row.seq,
            row.id.to_string(),
            kind,
            a.to_string(),
            b.to_string(),
            row.source.as_str(),
            &row.author,
            &row.note,
            row.created_at.to_string(),
            retraction.map(|r| r.created_at.to_string()),
            retraction.map(|r| &r.reason),
            row.replaces.map(|id| id.to_string()),
            row.restores.map(|id| id.to_string()),
        ]);
    }
    table
}

/// Get a preference
///
/// Retracted preferences are returned, too, with their retraction.
#[utoipa::path(
    get,
    path = "/preferences/{id}",
    operation_id = "get_preference",
    tag = "preferences",
    params(("id" = FeedbackId, Path, description = "Identifier of the preference")),
    responses((status = 200, description = "Preference", body = Preference), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<FeedbackId, Read>,
) -> Result<Json<Preference>, Refusal> {
    Ok(Json(feedback::get(&mut *app.read().await?, id).await?.try_into()?))
}

/// Recorded preference.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct CreatedPreference {
    #[serde(flatten)]
    row: Preference,
    /// Identifiers of other people's preferences about the same two gaits, at most the twenty newest.
    other_answers: Vec<FeedbackId>,
}

/// Create a preference
///
/// Records which of two gaits is better, or that there is no difference. Both gaits must be walkable. An author can
/// give only one answer per pair of gaits; to change an answer, name it in `replaces`.
#[utoipa::path(
    post,
    path = "/studies/{id}/preferences",
    operation_id = "create_preference",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    request_body = Answer,
    responses((status = 201, description = "Preference", body = CreatedPreference)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, access::Answer>,
    IdempotentWith(request, answer): IdempotentWith<access::Answer, Answer>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let given = preference_answer::give(&mut writer, &request.caller, id, &answer).await?;
    let row = feedback::get(&mut writer, given).await?;
    let other_answers =
        preference_answer::other_answers(&mut writer, &row).await?.into_iter().map(|other| other.id).collect();
    let location = format!("/api/v1/preferences/{given}");
    request.created(&app, writer, location, &CreatedPreference { row: row.try_into()?, other_answers }).await
}

/// Retraction of a preference, an assessment or a suggestion.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct AnswerRetraction {
    /// Why the answer is void.
    #[schema(min_length = 1, max_length = 2000)]
    pub(super) reason: String,
    /// Author of the retraction. Defaults to the caller's name.
    #[serde(default)]
    pub(super) author: Option<String>,
}

/// Retract a preference
///
/// The preference stays on record, but the learner no longer uses it. An answer that it replaced does not count again;
/// to restore that answer, undo the preference instead.
#[utoipa::path(
    post,
    path = "/preferences/{id}/retract",
    operation_id = "retract_preference",
    tag = "preferences",
    params(("id" = FeedbackId, Path, description = "Identifier of the preference")),
    request_body = AnswerRetraction,
    responses((status = 200, description = "Retracted preference", body = Preference)),
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
    let row =
        preference_answer::retract(&mut writer, &request.caller, None, id, why.author.as_deref(), &why.reason).await?;
    request.done(&app, writer, &Preference::try_from(row)?).await
}
