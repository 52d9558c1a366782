//! devices: read only; they come with the program.

use crate::access::Read;
use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::Id;
use crate::http::may::May;
use crate::store::DeviceId;
use crate::store::devices::{self, Device};
use axum::Json;
use axum::extract::State;

/// `GET`: all of them.
#[utoipa::path(
    get,
    path = "/devices",
    tag = "devices",
    responses((status = 200, description = "All of them", body = Vec<Device>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(_: May<Read>, State(app): State<AppState>) -> Result<Json<Vec<Device>>, Error> {
    Ok(Json(devices::all(&mut *app.read().await?).await?))
}

/// `GET {id}`.
#[utoipa::path(
    get,
    path = "/devices/{id}",
    tag = "devices",
    params(("id" = DeviceId, Path, description = "The device")),
    responses((status = 200, description = "The device", body = Device)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Id(id): Id<DeviceId>,
) -> Result<Json<Device>, Error> {
    Ok(Json(devices::get(&mut *app.read().await?, id).await?))
}
