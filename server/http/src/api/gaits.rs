//! Gaits: the trajectory of a trial.

use crate::AppState;
use crate::may::May;
use crate::negotiate::{csv_file, wants_csv};
use crate::problem::Refusal;
use crate::shown::Shown;
use axum::extract::State;
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use gaitwright_charts::gait_table::gait_csv;
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_store::{StoreError, TrialId, gaits, trials};

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
    State(mut app): State<AppState>,
    Shown(id, _): Shown<TrialId, Read>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    if wants_csv(&headers) {
        return table(&mut app, id).await;
    }
    let gait = gaits::get(&mut *app.read().await?, id).await?;
    let text = app.compute(move |pool| gait.text(pool)).await??;
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
    State(mut app): State<AppState>,
    Shown(id, _): Shown<TrialId, Read>,
) -> Result<Response, Refusal> {
    table(&mut app, id).await
}

async fn table(app: &mut AppState, id: TrialId) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    let number = trials::get(&mut reader, id).await?.number;
    let gait = gaits::get(&mut reader, id).await?;
    drop(reader);
    let table = move |pool: &OnPool| Ok::<_, StoreError>(gait_csv(&gait.unpack(pool)?));
    let table = app.compute(table).await??;
    Ok(csv_file(&format!("gait-trial-{number}.csv"), table))
}
