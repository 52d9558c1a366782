//! What is measured in the walks of a lab session.

use super::exports;
use crate::AppState;
use crate::may::May;
use crate::once::{Once, OnceWith};
use crate::problem::Refusal;
use crate::reached::Id;
use crate::shown::Shown;
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::Response;
use gait_optimizer::emg::EmgSettings;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{self, Brought, Checked, EmgView, FileForm, LimitCycles, NewEmg, NewMotion};
use gaitwright_store::lab_recordings::{self, LabRecording};
use gaitwright_store::{LabRecordingId, LabSessionId};
use serde::Deserialize;
use utoipa::ToSchema;

/// `GET /lab-sessions/{id}/recordings`: every file that was brought, oldest first; the newest of a walk counts.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/recordings",
    operation_id = "list_lab_recordings",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "The session")),
    responses((status = 200, description = "All of them", body = Vec<LabRecording>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<LabSessionId, Read>,
) -> Result<Json<Vec<LabRecording>>, Refusal> {
    Ok(Json(lab_recordings::of_session(&mut *app.read().await?, id).await?))
}

/// `GET /lab-recordings/{id}/file`: a file as it was brought, byte for byte. Its ETag is its SHA-256.
#[utoipa::path(
    get,
    path = "/lab-recordings/{id}/file",
    operation_id = "get_lab_recording_file",
    tag = "lab",
    params(("id" = LabRecordingId, Path, description = "The recording")),
    responses((status = 200, description = "The file; CSV, or an OpenSim file", body = String, content_type = "text/plain")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn file(
    _: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<LabRecordingId, Read>,
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

/// `POST /lab-sessions/{id}/electromyograms`: the electromyograms of a walk. A file that is not whole, or holds no
/// stride, is refused, and nothing of it is kept.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/electromyograms",
    operation_id = "add_electromyogram",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "The session")),
    request_body = NewEmg,
    responses((status = 201, description = "Kept", body = LabRecording)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn electromyogram(
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

/// `POST /lab-sessions/{id}/motions`: the joint angles of a walk, for its limit cycles.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/motions",
    operation_id = "add_lab_motion",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "The session")),
    request_body = NewMotion,
    responses((status = 201, description = "Kept", body = LabRecording)),
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
    once.finish(app, writer, StatusCode::CREATED, None, &kept).await
}

/// How electromyograms are filtered.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Processing {
    /// band_low_hz, band_high_hz, envelope_hz, order: what is left out has its default.
    #[schema(value_type = Object)]
    settings: EmgSettings,
}

/// `POST /lab-sessions/{id}/emg-results`: filters, cuts and normalises the newest electromyograms; with other settings as
/// often as wanted.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/emg-results",
    operation_id = "process_electromyograms",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "The session")),
    request_body = Processing,
    responses((status = 201, description = "What was made of them", body = EmgView)),
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
    once.finish(&app, writer, StatusCode::CREATED, None, &view).await
}

/// `GET /lab-sessions/{id}/emg-results`: the newest result of the electromyograms, and after unblinding the muscles of the
/// model for comparison.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/emg-results",
    operation_id = "get_emg_results",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "The session")),
    responses((status = 200, description = "The newest result; null: nothing was processed yet", body = Option<EmgView>)),
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
    responses((status = 200, description = "The newest motion of each walk", body = Vec<LimitCycles>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn limit_cycles(
    _: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<LabSessionId, Read>,
) -> Result<Json<Vec<LimitCycles>>, Refusal> {
    Ok(Json(lab::limit_cycles(app.store_mut(), id).await?))
}
