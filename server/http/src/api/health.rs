//! Health and readiness of the service.

use crate::AppState;
use crate::problem::Refusal;
use axum::Json;
use axum::extract::State;
use gaitwright_service::error::Error;
use serde::Serialize;
use std::fmt::Write;
use utoipa::ToSchema;

/// Health of the service.
#[derive(Debug, Serialize, ToSchema)]
pub struct Health {
    /// `ready`, or `short_of_space` if less disk space is free than the reserve.
    pub status: &'static str,
    /// Version of the program.
    pub version: &'static str,
}

/// Check that the service is healthy
///
/// Succeeds if the database responds. Needs no sign-in, and therefore reveals nothing about solves, from which a rater could
/// infer the effect of an answer. Fails if the database does not respond.
#[utoipa::path(
    get,
    path = "/health",
    operation_id = "get_health",
    tag = "health",
    responses((status = 200, description = "The service is ready", body = Health)),
)]
pub(crate) async fn get(State(app): State<AppState>) -> Result<Json<Health>, Refusal> {
    // The pool returns a connection only after the database has responded.
    drop(app.read().await?);
    let status = if app.store().room().is_ok() { "ready" } else { "short_of_space" };
    Ok(Json(Health { status, version: env!("CARGO_PKG_VERSION") }))
}

/// `GET /ready`: 200 if all tasks run and the record can be written, otherwise 503 with the reason.
///
/// # Errors
/// [`Error::NotReady`] with the reason, [`Error::StorageFull`] if the disk is full.
pub(crate) async fn ready(State(app): State<AppState>) -> Result<String, Refusal> {
    if app.scheduler.stopping().is_cancelled() {
        return Err(Error::NotReady("The service is stopping.".to_owned()).into());
    }
    let not_writable =
        |reason: String| Error::NotReady(format!("The record cannot be written: {}.", reason.trim_end_matches('.')));
    app.store().probe().await.map_err(not_writable)?;
    if let Some(trouble) = app.scheduler.trouble() {
        return Err(Error::NotReady(trouble).into());
    }
    let mut text = "ready".to_owned();
    // Below the reserve, answers still fit and only large work is refused.
    if let Err(shortage) = app.store().room() {
        // Writing to a String cannot fail.
        let _ = write!(text, "; {shortage}");
    }
    if app.backups.scheduled().is_some_and(|backups| backups.failure().is_some()) {
        text.push_str("; the last scheduled backup failed, see the page System");
    }
    Ok(text)
}
