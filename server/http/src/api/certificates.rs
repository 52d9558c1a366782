//! Certificates: a certification of a trial's gait that is independent of its optimisation.

use crate::AppState;
use crate::may::May;
use crate::once::Once;
use crate::problem::Refusal;
use crate::reached::Id;
use crate::shown::Shown;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use gait_optimizer::certificate::Certificate;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::certification;
use gaitwright_store::{TrialId, certificates};

/// `GET /trials/{id}/certificate`: as it was made.
#[utoipa::path(
    get,
    path = "/trials/{id}/certificate",
    operation_id = "get_certificate",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial")),
    responses((status = 200, description = "The certificate: `passed`, `objections`, `checks`, the stride-to-stride map and pushes", body = Object)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<TrialId, Read>,
) -> Result<Json<Certificate>, Refusal> {
    let missing = || Error::NotFound { what: "certificate of trial".to_owned(), id: id.to_string() };
    certificates::find(&mut *app.read().await?, id).await?.map(Json).ok_or_else(missing).map_err(Refusal)
}

/// `POST /trials/{id}/certificate`: makes it, where it is not made yet.
#[utoipa::path(
    post,
    path = "/trials/{id}/certificate",
    operation_id = "request_certificate",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial; its gait has converged")),
    responses((status = 200, description = "The certificate; making it takes some seconds", body = Object)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(mut app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    once: Once<Run>,
) -> Result<Response, Refusal> {
    if let Some(before) = once.answered_before(&app).await? {
        return Ok(before);
    }
    let begun = certification::begin(&mut *app.read().await?, id).await?;
    let certificate = certification::certificate(app.store_mut(), begun).await?;
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    certification::record(&mut writer, &once.actor, id, &certificate).await?;
    once.finish(&app, writer, StatusCode::OK, None, &certificate).await
}
