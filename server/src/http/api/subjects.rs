//! Subjects.

use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::Id;
use crate::http::once::OnceWith;
use crate::store::SubjectId;
use crate::store::subjects::{self, Subject};
use crate::studies::person::{self, NewSubject};
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;

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
    OnceWith(once, new): OnceWith<NewSubject>,
) -> Result<Response, Error> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let subject = person::add(&mut writer, &once.actor, &new).await?;
    let location = format!("/api/v1/subjects/{}", subject.id);
    once.finish(&app, writer, StatusCode::CREATED, Some(location), &subject).await
}
