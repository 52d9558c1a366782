//! REST: undo of preferences and assessments.

use crate::AppState;
use crate::accessible::Id;
use crate::idempotent::{Idempotent, IdempotentWith};
use crate::problem_details::Refusal;
use crate::resources::assessments::Assessment;
use crate::resources::feedback::Preference;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access;
use gaitwright_service::studies::recorded_answer::RecordedAnswer;
use gaitwright_service::studies::undo;
use gaitwright_store::{AnswerId, AssessmentId, FeedbackId};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Request to undo an answer.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct AnswerUndo {
    /// Name or pseudonym of the person who undoes the answer. Defaults to the caller's name.
    #[serde(default)]
    #[schema(min_length = 1, max_length = 80)]
    author: Option<String>,
}

/// The answer that counts again after an undo. Both fields are null if the undone answer replaced none.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct RestoredAnswer {
    /// The new entry with the content of the replaced preference.
    preference: Option<Preference>,
    /// The new entry with the content of the replaced assessment.
    assessment: Option<Assessment>,
}

/// Undo a preference
///
/// Retracts a preference that was recorded in the last two minutes. If it replaced an answer, a copy of that answer with
/// the same author is recorded, and counts in its place. An undo cannot be undone.
#[utoipa::path(
    post,
    path = "/preferences/{id}/undo",
    operation_id = "undo_preference",
    tag = "preferences",
    params(("id" = FeedbackId, Path, description = "Identifier of the preference")),
    request_body = AnswerUndo,
    responses((status = 200, description = "Answer that counts again", body = RestoredAnswer)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn preference(
    State(app): State<AppState>,
    Id(id, _): Id<FeedbackId, access::Answer>,
    IdempotentWith(request, by): IdempotentWith<access::Answer, AnswerUndo>,
) -> Result<Response, Refusal> {
    undo_answer(app, id.into(), (request, by)).await
}

/// Undo an assessment
///
/// Retracts an assessment that was recorded in the last two minutes. If it replaced an answer, a copy of that answer with
/// the same author is recorded, and counts in its place. An undo cannot be undone, nor can a safety report.
#[utoipa::path(
    post,
    path = "/assessments/{id}/undo",
    operation_id = "undo_assessment",
    tag = "preferences",
    params(("id" = AssessmentId, Path, description = "Identifier of the assessment")),
    request_body = AnswerUndo,
    responses((status = 200, description = "Answer that counts again", body = RestoredAnswer)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn assessment(
    State(app): State<AppState>,
    Id(id, _): Id<AssessmentId, access::Answer>,
    IdempotentWith(request, by): IdempotentWith<access::Answer, AnswerUndo>,
) -> Result<Response, Refusal> {
    undo_answer(app, id.into(), (request, by)).await
}

async fn undo_answer(
    app: AppState,
    id: AnswerId,
    (request, by): (Idempotent<access::Answer>, AnswerUndo),
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let mut restored = RestoredAnswer { preference: None, assessment: None };
    if let Some(id) = undo::undo(&mut writer, &request.caller, None, id, by.author.as_deref()).await? {
        match RecordedAnswer::get(&mut writer, None, id).await? {
            RecordedAnswer::Preference(row) => restored.preference = Some(row.try_into()?),
            RecordedAnswer::Assessment(row) => restored.assessment = Some(row.into()),
        }
    }
    request.done(&app, writer, &restored).await
}
