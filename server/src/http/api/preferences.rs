//! Preferences: answers to comparisons.

use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::{Body, Id};
use crate::store::feedback::{self, FeedbackRow, Said};
use crate::store::{FeedbackId, StudyId, commit, studies};
use crate::studies::answer::{self, Answer};
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderName, StatusCode, header};
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
    Body(answer): Body<Answer>,
) -> Result<(StatusCode, [(HeaderName, String); 1], Json<FeedbackRow>), Error> {
    let mut writer = app.write().await?;
    let given = answer::give(&mut writer, id, &answer).await?;
    let row = feedback::get(&mut writer, given).await?;
    commit(writer).await?;
    app.director.changed();
    Ok((StatusCode::CREATED, [(header::LOCATION, format!("/api/v1/preferences/{given}"))], Json(row)))
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
    Body(why): Body<Retract>,
) -> Result<Json<FeedbackRow>, Error> {
    let mut writer = app.write().await?;
    let row = answer::retract(&mut writer, id, &why.author, &why.reason).await?;
    commit(writer).await?;
    app.director.changed();
    Ok(Json(row))
}
