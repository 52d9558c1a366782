//! The page of all devices.

use crate::AppState;
use crate::authorization::Authorized;
use crate::page_error::{PageResult, page};
use askama::Template;
use axum::extract::State;
use gaitwright_service::access::Read;
use gaitwright_store::devices::{self, DeviceRow};

#[derive(Template)]
#[template(path = "devices.html")]
struct DevicesPage {
    devices: Vec<DeviceRow>,
}

/// `GET /devices`.
pub(super) async fn list(_: Authorized<Read>, State(app): State<AppState>) -> PageResult {
    page(&DevicesPage { devices: devices::all(&mut *app.read().await?).await? })
}
