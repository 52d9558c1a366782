//! devices: read only; they come with the program.

use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::Id;
use crate::store::DeviceId;
use crate::store::devices::{self, Device};
use axum::Json;
use axum::extract::State;

/// `GET`: all of them.
pub(super) async fn list(State(app): State<AppState>) -> Result<Json<Vec<Device>>, Error> {
    Ok(Json(devices::all(&mut *app.read().await?).await?))
}

/// `GET {id}`.
pub(super) async fn get(State(app): State<AppState>, Id(id): Id<DeviceId>) -> Result<Json<Device>, Error> {
    Ok(Json(devices::get(&mut *app.read().await?, id).await?))
}
