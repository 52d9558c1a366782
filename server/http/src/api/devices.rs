//! Devices: the built-in one, and those of data files.

use crate::AppState;
use crate::may::May;
use crate::once::OnceWith;
use crate::problem::Refusal;
use crate::reached::Id;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use gait_optimizer::Device as Definition;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::studies::device;
use gaitwright_store::DeviceId;
use gaitwright_store::devices::{self, Device};

/// `GET`: all of them.
#[utoipa::path(
    get,
    path = "/devices",
    operation_id = "list_devices",
    tag = "devices",
    responses((status = 200, description = "All of them", body = Vec<Device>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(_: May<Read>, State(app): State<AppState>) -> Result<Json<Vec<Device>>, Refusal> {
    Ok(Json(devices::all(&mut *app.read().await?).await?))
}

/// `POST`: adds the device of a data file. The very same file gives the device that is there already.
#[utoipa::path(
    post,
    path = "/devices",
    operation_id = "create_device",
    tag = "devices",
    request_body(content = Object, description = "A device file, as `optimizer/data/README.md` describes it"),
    responses((status = 201, description = "Added", body = Device)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    OnceWith(once, definition): OnceWith<Run, Definition>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let added = device::add(&mut writer, &once.actor, &definition).await?;
    let location = format!("/api/v1/devices/{}", added.id);
    once.finish(&app, writer, StatusCode::CREATED, Some(location), &added).await
}

/// `GET {id}`.
#[utoipa::path(
    get,
    path = "/devices/{id}",
    operation_id = "get_device",
    tag = "devices",
    params(("id" = DeviceId, Path, description = "The device")),
    responses((status = 200, description = "The device", body = Device)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<DeviceId, Read>,
) -> Result<Json<Device>, Refusal> {
    Ok(Json(devices::get(&mut *app.read().await?, id).await?))
}
