//! REST: measurement files of lab sessions.

use crate::AppState;
use crate::accessible::Id;
use crate::attachment::attachment;
use crate::authorization::Authorized;
use crate::idempotent::{Idempotent, IdempotentWith};
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::measurement_files::MeasurementFile;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderValue, header};
use axum::response::Response;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{self, CheckedFile, MeasurementFormat, NewEmg, NewJointAngles, UploadedFile};
use gaitwright_store::measurement_files::{self, MeasurementKind};
use gaitwright_store::{LabSessionId, MeasurementFileId};

/// List measurement files of a lab session
///
/// Oldest first. The newest file of each kind and walk is used.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/measurement-files",
    operation_id = "list_measurement_files",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    responses((status = 200, description = "A page", body = Page<MeasurementFile>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<LabSessionId, Read>,
    paging: Paging<MeasurementFileId>,
) -> Result<Json<Page<MeasurementFile>>, Refusal> {
    let all = measurement_files::of_session(&mut *app.read().await?, id).await?;
    Ok(Json(paging.cut(all, |recording| recording.id)?.map(MeasurementFile::from)))
}

/// Get the description of a measurement file
///
/// `get_measurement_file_content` has the file itself.
#[utoipa::path(
    get,
    path = "/measurement-files/{id}",
    operation_id = "get_measurement_file",
    tag = "lab",
    params(("id" = MeasurementFileId, Path, description = "Identifier of the measurement file")),
    responses((status = 200, description = "Description of the file", body = MeasurementFile), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<MeasurementFileId, Read>,
) -> Result<Json<MeasurementFile>, Refusal> {
    Ok(Json(measurement_files::get(&mut *app.read().await?, id).await?.into()))
}

/// Download a measurement file
///
/// The file as uploaded, byte for byte. Its ETag is its SHA-256.
#[utoipa::path(
    get,
    path = "/measurement-files/{id}/content",
    operation_id = "get_measurement_file_content",
    tag = "lab",
    params(("id" = MeasurementFileId, Path, description = "Identifier of the measurement file")),
    responses((status = 200, description = "CSV or OpenSim file", content((String = "text/csv"), (String = "text/plain"))), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn content(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<MeasurementFileId, Read>,
) -> Result<Response, Refusal> {
    let UploadedFile { recording, format, file } = lab::read_upload(&mut *app.read().await?, id).await?;
    let text = app.compute(move |pool| file.text(pool)).await??;
    let (kind, ending) = match format {
        MeasurementFormat::Csv => ("text/csv; charset=utf-8", "csv"),
        MeasurementFormat::Opensim => ("text/plain; charset=utf-8", "sto"),
    };
    let name = format!("walk-{}-{}-{}.{ending}", recording.walk, kind_of_file(recording.kind), id.short());
    let tag = HeaderValue::from_str(&format!("\"{}\"", recording.raw_sha256));
    let mut answer = attachment(kind, &name, text);
    answer.headers_mut().insert(header::ETAG, tag.map_err(|e| Error::Internal(e.to_string()))?);
    Ok(answer)
}

/// Create a measurement file with EMG
///
/// An incomplete file, or one without a complete stride, is refused.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/measurement-files/emg",
    operation_id = "create_emg_file",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    request_body = NewEmg,
    responses((status = 201, description = "Measurement file", body = MeasurementFile)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn emg(
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    IdempotentWith(request, new): IdempotentWith<Run, NewEmg>,
) -> Result<Response, Refusal> {
    if let Some(before) = request.earlier_response(&app).await? {
        return Ok(before);
    }
    let checked = new.checked(app.store_mut()).await?;
    keep(&app, id, &request, &checked).await
}

/// Create a measurement file with joint angles
///
/// Limit cycles are computed from the file.
#[utoipa::path(
    post,
    path = "/lab-sessions/{id}/measurement-files/joint-angles",
    operation_id = "create_joint_angle_file",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    request_body = NewJointAngles,
    responses((status = 201, description = "Measurement file", body = MeasurementFile)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn joint_angles(
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    IdempotentWith(request, new): IdempotentWith<Run, NewJointAngles>,
) -> Result<Response, Refusal> {
    if let Some(before) = request.earlier_response(&app).await? {
        return Ok(before);
    }
    let checked = new.checked(app.store_mut()).await?;
    keep(&app, id, &request, &checked).await
}

async fn keep(
    app: &AppState,
    id: LabSessionId,
    request: &Idempotent<Run>,
    checked: &CheckedFile,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let kept = lab::store_upload(&mut writer, &request.actor, id, checked).await?;
    let location = format!("/api/v1/measurement-files/{}", kept.id);
    request.created(app, writer, location, &MeasurementFile::from(kept)).await
}

/// The kind of a measurement file, in its name.
fn kind_of_file(kind: MeasurementKind) -> &'static str {
    match kind {
        MeasurementKind::Emg => "emg",
        MeasurementKind::JointAngles => "joint-angles",
    }
}
