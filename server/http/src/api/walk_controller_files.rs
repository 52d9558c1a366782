//! REST: controller files of the walks of a lab session, for the device.

use super::exports;
use crate::AppState;
use crate::authorization::Authorized;
use crate::extractors::Params;
use crate::problem_details::Refusal;
use crate::resources::document_schemas;
use crate::visible::Visible;
use axum::extract::State;
use axum::response::Response;
use gaitwright_compute::OnPool;
use gaitwright_service::access::Device;
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{self, GaitOfWalk};
use gaitwright_store::{LabSessionId, commit, lab_sessions};
use serde::Deserialize;

/// Walk and sampling.
#[derive(Debug, Deserialize)]
pub(super) struct WalkQuery {
    walk: u8,
    #[serde(default = "exports::default_rate_hz")]
    rate_hz: f64,
}

/// Download the controller file of a lab walk
///
/// The file does not name the trial, but comparing it with the controller files of both gaits reveals the allocation.
/// It is meant for the device, which uses a token with only the `device` scope. If anybody else fetches the file, the
/// session and the audit trail record this, and later answers of that caller do not count as blind.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/controller.json",
    operation_id = "get_walk_controller_file",
    tag = "lab",
    params(
        ("id" = LabSessionId, Path, description = "Identifier of the lab session"),
        ("walk" = u8, Query, description = "Number of the walk, 2 or 3. Walk 1 is without the device"),
        ("rate_hz" = Option<f64>, Query, description = "Sampling rate, 10 to 5000 Hz. Default 200")
    ),
    responses((status = 200, description = "Controller file", body = document_schemas::ControllerFile), (status = 409, description = "The gait is not walkable, or the subject withdrew consent")),
    security(("token" = ["device"]), ("session" = ["device"])),
)]
pub(super) async fn controller(
    authorized: Authorized<Device>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<LabSessionId, Device>,
    Params(of): Params<WalkQuery>,
) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    let session = lab_sessions::get(&mut reader, id).await?;
    // Make both files, because an error for one of them, or the time that it takes, would reveal the allocation.
    let (one, two) = lab::gaits_to_walk_with(&mut reader, &session, of.walk).await?;
    let of_one = one.trajectory(&mut reader).await?;
    let of_two = two.trajectory(&mut reader).await?;
    drop(reader);
    let write = move |pool: &OnPool| {
        let one = one.blinded_controller_file(&of_one.unpack(pool)?, of.rate_hz)?;
        let two = two.blinded_controller_file(&of_two.unpack(pool)?, of.rate_hz)?;
        Ok::<_, Error>((one, two))
    };
    let (one, two) = app.compute(write).await??;
    let mut writer = app.write().await?;
    let gait = lab::for_device(&mut writer, &authorized.caller, id, of.walk).await?;
    commit(writer).await?;
    let text = match gait {
        GaitOfWalk::A => one,
        GaitOfWalk::B => two,
    };
    let name = format!("controller-walk-{}.json", of.walk);
    Ok(exports::controller_file_response(&name, text, vec![session.trial_a, session.trial_b]))
}
