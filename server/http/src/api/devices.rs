//! REST: devices.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::IdempotentWith;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::devices::Device;
use crate::resources::document_schemas;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gait_optimizer::Device as Definition;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::studies::device;
use gaitwright_store::{DeviceId, devices};
use std::cmp::Reverse;

/// List devices
///
/// Newest first.
#[utoipa::path(
    get,
    path = "/devices",
    operation_id = "list_devices",
    tag = "devices",
    responses((status = 200, description = "A page", body = Page<Device>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    _: Authorized<Read>,
    State(app): State<AppState>,
    paging: Paging<Reverse<DeviceId>>,
) -> Result<Json<Page<Device>>, Refusal> {
    let all = devices::all(&mut *app.read().await?).await?;
    Ok(Json(paging.cut(all, |one| Reverse(one.id))?.map(Device::from)))
}

/// Create a device from a data file
///
/// If a device with the same definition exists, the response contains it.
#[utoipa::path(
    post,
    path = "/devices",
    operation_id = "create_device",
    tag = "devices",
    request_body(content = document_schemas::DeviceDefinition, description = "A device file, as `/help/data-files` describes it"),
    responses(
        (status = 200, description = "Existing device with the same definition", body = Device),
        (status = 201, description = "Device", body = Device)
    ),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    IdempotentWith(request, definition): IdempotentWith<Run, Definition>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let (device, added) = device::add(&mut writer, &request.actor, &definition).await?;
    let location = format!("/api/v1/devices/{}", device.id);
    let device = Device::from(device);
    if !added {
        return request.done(&app, writer, &device).await;
    }
    request.created(&app, writer, location, &device).await
}

/// Get a device
///
/// With its whole definition: masses, lengths and limits of the prosthetic joints.
#[utoipa::path(
    get,
    path = "/devices/{id}",
    operation_id = "get_device",
    tag = "devices",
    params(("id" = DeviceId, Path, description = "Identifier of the device")),
    responses((status = 200, description = "Device", body = Device)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<DeviceId, Read>,
) -> Result<Json<Device>, Refusal> {
    Ok(Json(devices::get(&mut *app.read().await?, id).await?.into()))
}
