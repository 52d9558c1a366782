//! Gaits: the trajectory of a trial.

use crate::access::Read;
use crate::error::Error;
use crate::http::AppState;
use crate::http::may::May;
use crate::http::negotiate::{csv_answer, wants_csv};
use crate::http::shown::Shown;
use crate::store::{TrialId, gaits, trials};
use axum::extract::State;
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use gait_optimizer::Gait;

/// `GET /trials/{id}/gait`: as the optimiser wrote it, or its trajectory as CSV.
#[utoipa::path(
    get,
    path = "/trials/{id}/gait",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial")),
    responses((status = 200, description = "The trajectory as the optimiser wrote it; CSV where `Accept` asks for it", content((Object = "application/json"), (String = "text/csv")))),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id): Shown<TrialId>,
    headers: HeaderMap,
) -> Result<Response, Error> {
    if wants_csv(&headers) {
        return table(&app, id).await;
    }
    let text = gaits::json_of(&mut *app.read().await?, id).await?;
    let headers = [(header::CONTENT_TYPE, "application/json"), (header::VARY, "Accept")];
    Ok((headers, text).into_response())
}

/// `GET /trials/{id}/gait.csv`.
#[utoipa::path(
    get,
    path = "/trials/{id}/gait.csv",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial")),
    responses((status = 200, description = "One row per mesh point", body = String, content_type = "text/csv")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get_csv(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id): Shown<TrialId>,
) -> Result<Response, Error> {
    table(&app, id).await
}

async fn table(app: &AppState, id: TrialId) -> Result<Response, Error> {
    let mut reader = app.read().await?;
    let number = trials::get(&mut reader, id).await?.number;
    let gait = gaits::get(&mut reader, id).await?;
    drop(reader);
    let (header, rows) = rows(&gait);
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    csv_answer(&format!("gait-trial-{number}.csv"), &header, rows)
}

const COORDINATES: [&str; 9] = ["px", "pz", "torso", "hip_L", "knee_L", "ankle_L", "hip_R", "knee_R", "ankle_R"];
const JOINTS: [&str; 6] = ["hip_L", "knee_L", "ankle_L", "hip_R", "knee_R", "ankle_R"];

/// One row per mesh point: time, domain, q, qd, torques, ground forces (the four points, zero where there is no
/// contact), activations.
fn rows(gait: &Gait) -> (Vec<String>, Vec<Vec<String>>) {
    let unit = |name: &str| if name.starts_with('p') { "m" } else { "rad" };
    let mut header = vec!["time_s".to_owned(), "domain".to_owned()];
    header.extend(COORDINATES.iter().map(|name| format!("{name}_{}", unit(name))));
    header.extend(COORDINATES.iter().map(|name| format!("d{name}_{}_s", unit(name))));
    header.extend(JOINTS.iter().map(|name| format!("torque_{name}_Nm")));
    let forces = crate::http::gait_series::FORCE_NAMES;
    header.extend(forces.iter().map(|name| format!("{name}_N")));
    let muscles = gait.domains.iter().any(|domain| domain.muscles.is_some());
    if muscles {
        header.extend(crate::http::gait_series::MUSCLES.iter().map(|name| format!("activation_{name}")));
    }
    let mut rows = Vec::new();
    for point in crate::http::gait_series::points(gait) {
        let mut row = vec![point.time_s.to_string(), point.domain.to_owned()];
        row.extend(point.q.iter().chain(point.qd).chain(point.u).chain(&point.forces).map(f64::to_string));
        row.extend(point.activation.iter().flat_map(|a| a.iter()).map(f64::to_string));
        rows.push(row);
    }
    (header, rows)
}
