//! Subjects.

use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::{Body, Id};
use crate::store::subjects::{self, Subject};
use crate::store::{SubjectId, commit};
use crate::studies::person::{self, NewSubject};
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderName, StatusCode, header};

/// `GET`: all of them.
pub(super) async fn list(State(app): State<AppState>) -> Result<Json<Vec<Subject>>, Error> {
    Ok(Json(subjects::all(&mut *app.read().await?).await?))
}

/// `GET {id}`.
pub(super) async fn get(State(app): State<AppState>, Id(id): Id<SubjectId>) -> Result<Json<Subject>, Error> {
    Ok(Json(subjects::get(&mut *app.read().await?, id).await?))
}

/// `POST`: adds one.
pub(super) async fn create(
    State(app): State<AppState>,
    Body(new): Body<NewSubject>,
) -> Result<(StatusCode, [(HeaderName, String); 1], Json<Subject>), Error> {
    let mut writer = app.write().await?;
    let subject = person::add(&mut writer, &new).await?;
    commit(writer).await?;
    Ok((StatusCode::CREATED, [(header::LOCATION, format!("/api/v1/subjects/{}", subject.id))], Json(subject)))
}
