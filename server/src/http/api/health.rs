//! Whether the service is ready.

use crate::error::Error;
use crate::http::AppState;
use crate::store::jobs;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

/// What `/health` answers.
#[derive(Debug, Serialize, ToSchema)]
pub struct Health {
    /// `ready`.
    pub status: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// How many solves can run at the same time.
    pub workers: usize,
    /// Solves that wait.
    pub jobs_queued: u32,
    /// Solves that run.
    pub jobs_running: u32,
}

/// `GET /health`: 200 when the database answers.
///
/// # Errors
/// When it does not.
#[utoipa::path(
    get,
    path = "/health",
    tag = "health",
    responses((status = 200, description = "The service is ready", body = Health)),
)]
pub async fn get(State(app): State<AppState>) -> Result<Json<Health>, Error> {
    let (jobs_queued, jobs_running) = jobs::depth(&mut *app.read().await?).await?;
    let version = env!("CARGO_PKG_VERSION");
    Ok(Json(Health { status: "ready", version, workers: app.director.workers(), jobs_queued, jobs_running }))
}

/// `GET /ready`: 200 when the service takes writes, 503 when it is shutting down or the record cannot be written.
///
/// # Errors
/// When the record cannot be written.
pub async fn ready(State(app): State<AppState>) -> Result<Response, Error> {
    if app.director.stopping().is_cancelled() {
        return Ok((StatusCode::SERVICE_UNAVAILABLE, "stopping").into_response());
    }
    // Begun and dropped: proves that the one connection that writes is there, and leaves no trace.
    drop(app.write().await?);
    Ok("ready".into_response())
}
