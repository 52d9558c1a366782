//! Preferences: answers to comparisons.

use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::Id;
use crate::http::once::OnceWith;
use crate::store::feedback::{self, FeedbackRow, Said};
use crate::store::{FeedbackId, StudyId, studies};
use crate::studies::answer::{self, Answer};
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use serde::Deserialize;

/// `GET /studies/{id}/preferences`: as given, retracted ones included.
pub(super) async fn of_study(
    State(app): State<AppState>,
    Id(id): Id<StudyId>,
) -> Result<Json<Vec<FeedbackRow>>, Error> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let mut rows = feedback::of_study(&mut reader, id, 0).await?;
    rows.retain(|row| matches!(row.said, Said::Preference { .. } | Said::Tie { .. }));
    Ok(Json(rows))
}

/// `GET /preferences/{id}`.
pub(super) async fn get(State(app): State<AppState>, Id(id): Id<FeedbackId>) -> Result<Json<FeedbackRow>, Error> {
    Ok(Json(feedback::get(&mut *app.read().await?, id).await?))
}

/// `POST /studies/{id}/preferences`.
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id): Id<StudyId>,
    OnceWith(once, answer): OnceWith<Answer>,
) -> Result<Response, Error> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let given = answer::give(&mut writer, &once.actor, id, &answer).await?;
    let row = feedback::get(&mut writer, given).await?;
    let location = format!("/api/v1/preferences/{given}");
    once.finish(&app, writer, StatusCode::CREATED, Some(location), &row).await
}

/// Why an answer is taken back.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Retract {
    reason: String,
    #[serde(default = "unnamed")]
    author: String,
}

fn unnamed() -> String {
    "not signed in".to_owned()
}

/// `POST /preferences/{id}/retract`.
pub(super) async fn retract(
    State(app): State<AppState>,
    Id(id): Id<FeedbackId>,
    OnceWith(once, why): OnceWith<Retract>,
) -> Result<Response, Error> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let row = answer::retract(&mut writer, &once.actor, None, id, &why.author, &why.reason).await?;
    once.finish(&app, writer, StatusCode::OK, None, &row).await
}
