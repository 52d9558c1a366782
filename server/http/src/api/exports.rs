//! A trial's gait for other programs.

use crate::AppState;
use crate::extract::Params;
use crate::may::May;
use crate::problem::Refusal;
use crate::reached::Id;
use crate::shown::Shown;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use gait_optimizer::export;
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::solve_input::PackedInput;
use gaitwright_service::studies::walkable::{self, NotWalkable};
use gaitwright_store::{TrialId, consents, gaits, schema, trials};
use serde::Deserialize;

/// How densely a gait is sampled.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sampling {
    /// Samples per second.
    #[serde(default = "two_hundred")]
    rate_hz: f64,
}

pub(super) fn two_hundred() -> f64 {
    200.0
}

/// `GET /trials/{id}/problem.json`: everything that the solve of the trial depends on.
#[utoipa::path(
    get,
    path = "/trials/{id}/problem.json",
    operation_id = "get_solve_problem",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial; what it started from was not dropped")),
    responses((status = 200, description = "What `gaitwright solve --problem` solves again", body = schema::SolveProblem), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn problem(
    _: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<TrialId, Read>,
) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    let number = trials::get(&mut reader, id).await?.number;
    let input = PackedInput::of_trial(&mut reader, id).await?;
    drop(reader);
    let text = app.compute(move |pool| input.unpack(pool)?.to_json()).await??;
    Ok(file("application/json", &format!("problem-trial-{number}.json"), text))
}

/// `GET /trials/{id}/gait.mot`: OpenSim motion file.
#[utoipa::path(
    get,
    path = "/trials/{id}/gait.mot",
    operation_id = "get_gait_motion_file",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial"), ("rate_hz" = Option<f64>, Query, description = "Samples per second: 10 to 5000; by default 200")),
    responses((status = 200, description = "OpenSim motion file: degrees, OpenSim's signs", body = String, content_type = "text/plain"), (status = 409, description = "The subject withdrew consent"), (status = 422, description = "A parameter is not acceptable")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn motion_file(
    _: May<Read>,
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
    Ok(file("text/plain; charset=utf-8", &format!("gait-trial-{}.mot", trial.number), text))
}

/// `GET /trials/{id}/controller.json`: what the device's controller needs.
#[utoipa::path(
    get,
    path = "/trials/{id}/controller.json",
    operation_id = "get_controller_file",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial; its gait has converged and is certified, and no safety report against it is open"), ("rate_hz" = Option<f64>, Query, description = "Samples per second: 10 to 5000; by default 200")),
    responses((status = 200, description = "Controller file: curves and phase of every domain, set points of the prosthetic joints", body = schema::ControllerFile), (status = 409, description = "The gait may not be walked with, or the subject withdrew consent"), (status = 422, description = "A parameter is not acceptable")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn controller(
    _: May<Read>,
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
    Ok(file("application/json", &format!("device-trial-{number}.json"), text))
}

/// An answer that a browser saves under `name`.
pub(super) fn file(kind: &'static str, name: &str, text: String) -> Response {
    let headers = [
        (header::CONTENT_TYPE, kind.to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
    ];
    (headers, text).into_response()
}
