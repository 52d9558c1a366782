//! REST: EMG results of lab sessions: the processed EMG recordings.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::IdempotentWith;
use crate::problem_details::Refusal;
use crate::resources::document_schemas;
use crate::resources::emg::ProcessedEmg;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gait_optimizer::emg::EmgSettings;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab;
use gaitwright_store::LabSessionId;
use serde::Deserialize;
use utoipa::ToSchema;

/// Settings of EMG processing.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct EmgProcessing {
    /// band_low_hz, band_high_hz, envelope_hz and order. Absent settings take their default values.
    #[schema(value_type = document_schemas::EmgSettings)]
    settings: EmgSettings,
}

/// Names a refused setting as the body does.
fn of_settings(error: Error) -> Error {
    match error {
        Error::Invalid(refused) => refused.renamed("emg.", "settings.").into(),
        other => other,
    }
}

/// Create an EMG result
///
/// Filters, segments and normalises the newest EMG recording of each walk. Can be repeated with other settings.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/emg-results",
    operation_id = "create_emg_result",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    request_body = EmgProcessing,
    responses((status = 201, description = "Result", body = ProcessedEmg)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    IdempotentWith(request, processing): IdempotentWith<Run, EmgProcessing>,
) -> Result<Response, Refusal> {
    if let Some(before) = request.earlier_response(&app).await? {
        return Ok(before);
    }
    let result = lab::compute(app.store_mut(), id, processing.settings).await.map_err(of_settings)?;
    let view = lab::with_model(app.store_mut(), id, result).await?;
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    lab::keep_result(&mut writer, &request.actor, id, &view.result).await?;
    let location = format!("/api/v1/lab-sessions/{id}/emg-results");
    request.created(&app, writer, location, &ProcessedEmg::from(view)).await
}

/// Get the newest EMG result
///
/// The newest result. After unblinding, includes the muscle activity of the model. Without a result, the status is 404.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/emg-results",
    operation_id = "get_emg_result",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    responses((status = 200, description = "Newest result", body = ProcessedEmg), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<LabSessionId, Read>,
) -> Result<Json<ProcessedEmg>, Refusal> {
    let found = lab::emg(app.store_mut(), id).await?;
    let missing = || Error::NotFound { what: "EMG result for lab session".to_owned(), id: id.to_string() };
    Ok(Json(found.ok_or_else(missing)?.into()))
}
