//! Whether the service is ready.

use crate::AppState;
use crate::problem::Refusal;
use axum::Json;
use axum::extract::State;
use gaitwright_service::error::Error;
use serde::Serialize;
use utoipa::ToSchema;

/// What `/health` answers.
#[derive(Debug, Serialize, ToSchema)]
pub struct Health {
    /// `ready`, or `short_of_space` when less of the disk is free than is kept in reserve.
    pub status: &'static str,
    /// Version of the program.
    pub version: &'static str,
}

/// `GET /health`: 200 when the database answers. Nothing here says what the service is doing: anybody may ask, and solves tell
/// a rater what an answer led to. `/metrics` has the queue.
///
/// # Errors
/// When it does not.
#[utoipa::path(
    get,
    path = "/health",
    operation_id = "get_health",
    tag = "health",
    responses((status = 200, description = "The service is ready", body = Health)),
)]
pub(crate) async fn get(State(app): State<AppState>) -> Result<Json<Health>, Refusal> {
    // A connection is handed out once the database has answered on it.
    drop(app.read().await?);
    let status = if app.store().room().is_ok() { "ready" } else { "short_of_space" };
    Ok(Json(Health { status, version: env!("CARGO_PKG_VERSION") }))
}

/// `GET /ready`: 200 when the service does its work and takes changes, otherwise 503 with the reason.
///
/// # Errors
/// [`Error::NotReady`] with the reason, [`Error::StorageFull`] when the disk is full.
pub(crate) async fn ready(State(app): State<AppState>) -> Result<String, Refusal> {
    if app.scheduler.stopping().is_cancelled() {
        return Err(Error::NotReady("the service is stopping".to_owned()).into());
    }
    let not_writable = |reason: String| Error::NotReady(format!("the record takes no changes: {reason}"));
    app.store().probe().await.map_err(not_writable)?;
    if let Some(trouble) = app.scheduler.trouble() {
        return Err(Error::NotReady(trouble).into());
    }
    // Answers still fit: what is large is refused, with the same words.
    Ok(app.store().room().map_or_else(|shortage| format!("ready; {shortage}"), |()| "ready".to_owned()))
}
