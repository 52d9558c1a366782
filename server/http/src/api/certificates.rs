//! REST: certificates of gaits.

use super::jobs::Job;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::Idempotent;
use crate::problem_details::Refusal;
use crate::resources::certificates::Certificate;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::job::JobId;
use gaitwright_service::studies::certificate_request;
use gaitwright_store::{TrialId, certificates};

/// Get the certificate of a trial
///
/// The result of checking the gait independently of the optimiser.
#[utoipa::path(
    get,
    path = "/trials/{id}/certificate",
    operation_id = "get_certificate",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses((status = 200, description = "Certificate", body = Certificate), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
) -> Result<Json<Certificate>, Refusal> {
    let missing = || Error::NotFound { what: "certificate for trial".to_owned(), id: id.to_string() };
    let certificate = certificates::find(&mut *app.read().await?, id).await?.ok_or_else(missing)?;
    Ok(Json(certificate.into()))
}

/// Request the certificate of a trial
///
/// The gait of the trial must have converged.
#[utoipa::path(
    post,
    path = "/trials/{id}/certificate",
    operation_id = "request_certificate",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses(
        (status = 200, description = "Finished job for the existing certificate", body = Job),
        (status = 202, description = "Job that makes the certificate, which takes a few seconds", body = Job)
    ),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    request: Idempotent<Run>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    certificate_request::ask(&mut writer, &app.scheduler, &request.actor, id).await?;
    Job::respond(&request, &app, writer, JobId::Certificate(id)).await
}
