//! What is measured in the walks of a lab session.

use super::exports;
use crate::AppState;
use crate::may::May;
use crate::once::{Once, OnceWith};
use crate::paging::{Page, Paging};
use crate::problem::Refusal;
use crate::reached::Id;
use crate::shown::Shown;
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderValue, header};
use axum::response::Response;
use gait_optimizer::emg::EmgSettings;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{self, Brought, Checked, EmgView, FileForm, LimitCycles, NewEmg, NewMotion};
use gaitwright_store::measurement_files::{self, MeasurementFile};
use gaitwright_store::{LabSessionId, MeasurementFileId, schema};
use serde::Deserialize;
use utoipa::ToSchema;

/// `GET /lab-sessions/{id}/measurement-files`: every file that was added, oldest first; the newest of a walk counts.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/measurement-files",
    operation_id = "list_measurement_files",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "The session")),
    responses((status = 200, description = "All of them", body = Page<MeasurementFile>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<LabSessionId, Read>,
    paging: Paging<MeasurementFileId>,
) -> Result<Json<Page<MeasurementFile>>, Refusal> {
    let all = measurement_files::of_session(&mut *app.read().await?, id).await?;
    Ok(Json(paging.cut(all, |recording| recording.id)?))
}

/// `GET /measurement-files/{id}`.
#[utoipa::path(
    get,
    path = "/measurement-files/{id}",
    operation_id = "get_measurement_file",
    tag = "lab",
    params(("id" = MeasurementFileId, Path, description = "The file")),
    responses((status = 200, description = "The file, without its content", body = MeasurementFile), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<MeasurementFileId, Read>,
) -> Result<Json<MeasurementFile>, Refusal> {
    Ok(Json(measurement_files::get(&mut *app.read().await?, id).await?))
}

/// `GET /measurement-files/{id}/content`: the file byte for byte. Its ETag is its SHA-256.
#[utoipa::path(
    get,
    path = "/measurement-files/{id}/content",
    operation_id = "get_measurement_file_content",
    tag = "lab",
    params(("id" = MeasurementFileId, Path, description = "The file")),
    responses((status = 200, description = "The file; CSV, or an OpenSim file", body = String, content_type = "text/plain"), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn content(
    _: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<MeasurementFileId, Read>,
) -> Result<Response, Refusal> {
    let Brought { recording, form, file } = lab::brought(&mut *app.read().await?, id).await?;
    let text = app.compute(move |pool| file.text(pool)).await??;
    let (kind, ending) = match form {
        FileForm::Csv => ("text/csv; charset=utf-8", "csv"),
        FileForm::Opensim => ("text/plain; charset=utf-8", "sto"),
    };
    let name = format!("walk-{}-{}-{}.{ending}", recording.walk, recording.kind.as_str(), id.short());
    let tag = HeaderValue::from_str(&format!("\"{}\"", recording.raw_sha256));
    let mut answer = exports::file(kind, &name, text);
    answer.headers_mut().insert(header::ETAG, tag.map_err(|e| Error::Internal(e.to_string()))?);
    Ok(answer)
}

/// `POST /lab-sessions/{id}/measurement-files/emg`: the electromyograms of a walk. A file that is not whole, or holds no
/// stride, is refused, and nothing of it is kept.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/measurement-files/emg",
    operation_id = "add_emg_file",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "The session")),
    request_body = NewEmg,
    responses((status = 201, description = "Kept", body = MeasurementFile)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn emg(
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    OnceWith(once, new): OnceWith<Run, NewEmg>,
) -> Result<Response, Refusal> {
    if let Some(before) = once.answered_before(&app).await? {
        return Ok(before);
    }
    let checked = new.checked(app.store_mut()).await?;
    keep(&app, id, &once, &checked).await
}

/// `POST /lab-sessions/{id}/measurement-files/motion`: the joint angles of a walk, for its limit cycles.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/measurement-files/motion",
    operation_id = "add_motion_file",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "The session")),
    request_body = NewMotion,
    responses((status = 201, description = "Kept", body = MeasurementFile)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn motion(
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    OnceWith(once, new): OnceWith<Run, NewMotion>,
) -> Result<Response, Refusal> {
    if let Some(before) = once.answered_before(&app).await? {
        return Ok(before);
    }
    let checked = new.checked(app.store_mut()).await?;
    keep(&app, id, &once, &checked).await
}

async fn keep(app: &AppState, id: LabSessionId, once: &Once<Run>, checked: &Checked) -> Result<Response, Refusal> {
    let mut writer = match once.begin(app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let kept = lab::keep(&mut writer, &once.actor, id, checked).await?;
    once.created(app, writer, format!("/api/v1/measurement-files/{}", kept.id), &kept).await
}

/// How electromyograms are filtered.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Processing {
    /// band_low_hz, band_high_hz, envelope_hz, order: what is left out has its default.
    #[schema(value_type = schema::EmgSettings)]
    settings: EmgSettings,
}

/// `POST /lab-sessions/{id}/emg-results`: filters, cuts and normalises the newest electromyograms; with other settings as
/// often as wanted.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/emg-results",
    operation_id = "process_emg",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "The session")),
    request_body = Processing,
    responses((status = 200, description = "The result", body = EmgView)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn process(
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    OnceWith(once, processing): OnceWith<Run, Processing>,
) -> Result<Response, Refusal> {
    if let Some(before) = once.answered_before(&app).await? {
        return Ok(before);
    }
    let result = lab::compute(app.store_mut(), id, processing.settings).await?;
    let view = lab::beside_model(app.store_mut(), id, result).await?;
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    lab::keep_result(&mut writer, &once.actor, id, &view.result).await?;
    once.done(&app, writer, &view).await
}

/// `GET /lab-sessions/{id}/emg-results`: the newest result of the electromyograms, and after unblinding the muscles of the
/// model for comparison.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/emg-results",
    operation_id = "get_emg_results",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "The session")),
    responses((status = 200, description = "The newest result; null: nothing was processed yet", body = Option<EmgView>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn result(
    _: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<LabSessionId, Read>,
) -> Result<Json<Option<EmgView>>, Refusal> {
    Ok(Json(lab::emg(app.store_mut(), id).await?))
}

/// `GET /lab-sessions/{id}/limit-cycles`: angle and velocity of every joint that was recorded.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/limit-cycles",
    operation_id = "get_limit_cycles",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "The session")),
    responses((status = 200, description = "The newest motion of each walk", body = Page<LimitCycles>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn limit_cycles(
    _: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<LabSessionId, Read>,
    paging: Paging<usize>,
) -> Result<Json<Page<LimitCycles>>, Refusal> {
    Ok(Json(paging.cut_by_place(lab::limit_cycles(app.store_mut(), id).await?)?))
}
