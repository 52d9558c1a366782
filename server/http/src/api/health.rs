//! Health and readiness of the service.

use crate::AppState;
use crate::problem_details::Refusal;
use crate::readiness;
use axum::Json;
use axum::extract::State;
use serde::Serialize;
use std::fmt::Write;
use utoipa::ToSchema;

/// Health of the service.
#[derive(Debug, Serialize, ToSchema)]
pub struct Health {
    /// `healthy`, or `short_of_space` if free disk space is below the reserve.
    pub status: &'static str,
    /// Version of the program.
    pub version: &'static str,
}

/// Get the health of the service
///
/// Succeeds if the database responds. Requires no sign-in. It reveals nothing about solves, because a rater could infer
/// the effect of an answer from them.
#[utoipa::path(
    get,
    path = "/health",
    operation_id = "get_health",
    tag = "health",
    responses((status = 200, description = "The database responds", body = Health)),
)]
pub(crate) async fn get(State(app): State<AppState>) -> Result<Json<Health>, Refusal> {
    // The pool returns a connection only after the database has responded.
    drop(app.read().await?);
    let status = if app.store().check_free_space().is_ok() { "healthy" } else { "short_of_space" };
    Ok(Json(Health { status, version: env!("CARGO_PKG_VERSION") }))
}

/// `GET /ready`: 200 if all tasks run and the record can be written, otherwise 503 with the reason.
///
/// # Errors
/// The reason, as a problem document.
pub(crate) async fn ready(State(app): State<AppState>) -> Result<String, Refusal> {
    readiness::check(&app).await?;
    let mut text = "ready".to_owned();
    // Below the reserve, answers still fit and only large work is refused.
    if let Err(shortage) = app.store().check_free_space() {
        // Writing to a String cannot fail.
        let _ = write!(text, "\n{shortage}");
    }
    if app.backups.scheduled().is_some_and(|backups| backups.failure().is_some()) {
        text.push_str("\nThe last scheduled backup failed. See the System page.");
    }
    Ok(text)
}
