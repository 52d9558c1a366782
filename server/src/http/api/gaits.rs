//! Gaits: the trajectory of a trial.

use crate::access::Read;
use crate::error::Error;
use crate::gait_table::gait_csv;
use crate::http::AppState;
use crate::http::may::May;
use crate::http::negotiate::{csv_file, wants_csv};
use crate::http::shown::Shown;
use crate::store::{TrialId, gaits, trials};
use axum::extract::State;
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};

/// `GET /trials/{id}/gait`: as the optimiser wrote it, or its trajectory as CSV.
#[utoipa::path(
    get,
    path = "/trials/{id}/gait",
    operation_id = "get_gait",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial")),
    responses((status = 200, description = "The trajectory as the optimiser wrote it; CSV where `Accept` asks for it", content((Object = "application/json"), (String = "text/csv")))),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<TrialId, Read>,
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
    operation_id = "get_gait_csv",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial")),
    responses((status = 200, description = "One row per node", body = String, content_type = "text/csv")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get_csv(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<TrialId, Read>,
) -> Result<Response, Error> {
    table(&app, id).await
}

async fn table(app: &AppState, id: TrialId) -> Result<Response, Error> {
    let mut reader = app.read().await?;
    let number = trials::get(&mut reader, id).await?.number;
    let gait = gaits::get(&mut reader, id).await?;
    drop(reader);
    Ok(csv_file(&format!("gait-trial-{number}.csv"), gait_csv(&gait)))
}
