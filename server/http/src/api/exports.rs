//! REST: downloads of a trial: problem file, OpenSim motion file, controller file.

use crate::AppState;
use crate::access_log_layer::OnlyWhileWalkable;
use crate::accessible::Id;
use crate::attachment::attachment;
use crate::authorization::Authorized;
use crate::extractors::Params;
use crate::problem_details::Refusal;
use crate::resources::document_schemas;
use crate::visible::Visible;
use axum::extract::State;
use axum::response::Response;
use gait_optimizer::export;
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::problem_file::PackedInput;
use gaitwright_service::studies::walkable::{self, NotWalkable};
use gaitwright_store::{TrialId, consents, gaits, trials};
use serde::Deserialize;

/// Sampling of a gait.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sampling {
    /// Sampling rate, Hz.
    #[serde(default = "default_rate_hz")]
    rate_hz: f64,
}

pub(super) fn default_rate_hz() -> f64 {
    200.0
}

/// Download the problem file of a trial
///
/// Everything that the solve depends on: subject, device, bounds, settings, reference gait, limits and warm start.
#[utoipa::path(
    get,
    path = "/trials/{id}/problem.json",
    operation_id = "get_solve_problem",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses((status = 200, description = "Input for `gaitwright solve --problem`", body = document_schemas::SolveProblem), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn problem(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    let number = trials::get(&mut reader, id).await?.number;
    let input = PackedInput::of_trial(&mut reader, id).await?;
    drop(reader);
    let text = app.compute(move |pool| input.unpack(pool)?.to_json()).await??;
    Ok(attachment("application/json", &format!("problem-trial-{number}.json"), text))
}

/// Download the gait as an OpenSim motion file
///
/// One stride from right heel strike, with a column for each coordinate.
#[utoipa::path(
    get,
    path = "/trials/{id}/gait.mot",
    operation_id = "get_opensim_file",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial"), ("rate_hz" = Option<f64>, Query, description = "Sampling rate, 10 to 5000 Hz. Default 200")),
    responses((status = 200, description = "OpenSim motion file in degrees, with OpenSim's signs", body = String, content_type = "text/plain"), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn motion_file(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Id(id, _): Id<TrialId, Read>,
    Params(sampling): Params<Sampling>,
) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    let trial = trials::get(&mut reader, id).await?;
    consents::may_be_shown(&mut reader, trial.study_id).await?;
    let gait = gaits::get(&mut reader, id).await?;
    drop(reader);
    let write = move |pool: &OnPool| Ok::<_, Error>(export::motion_file(&gait.unpack(pool)?, sampling.rate_hz)?);
    let text = app.compute(write).await??;
    Ok(attachment("text/plain; charset=utf-8", &format!("gait-trial-{}.mot", trial.number), text))
}

/// Download the controller file of a trial
///
/// The gait must be walkable: converged, with a certificate, and without a safety report in force.
#[utoipa::path(
    get,
    path = "/trials/{id}/controller.json",
    operation_id = "get_controller_file",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial"), ("rate_hz" = Option<f64>, Query, description = "Sampling rate, 10 to 5000 Hz. Default 200")),
    responses((status = 200, description = "Controller file: curves and phase of every domain, and set points of the prosthetic joints", body = document_schemas::ControllerFile), (status = 409, description = "The gait is not walkable, or the subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn controller(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Id(id, _): Id<TrialId, Read>,
    Params(sampling): Params<Sampling>,
) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    let found = walkable::admit(&mut reader, id).await?;
    if matches!(found, Err(NotWalkable::NotCertified { .. })) {
        app.scheduler.certify(id);
    }
    let gait = found?;
    let trajectory = gait.trajectory(&mut reader).await?;
    drop(reader);
    let number = gait.number();
    let write = move |pool: &OnPool| gait.controller_file(&trajectory.unpack(pool)?, sampling.rate_hz);
    let text = app.compute(write).await??;
    Ok(controller_file_response(&format!("controller-trial-{number}.json"), text, vec![id]))
}

/// A controller file, which is sent only if every gait that it may be of is still walkable then.
pub(super) fn controller_file_response(name: &str, text: String, gaits: Vec<TrialId>) -> Response {
    let mut answer = attachment("application/json", name, text);
    answer.extensions_mut().insert(OnlyWhileWalkable(gaits));
    answer
}
