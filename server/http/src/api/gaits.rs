//! REST: gaits of trials.

use crate::AppState;
use crate::authorization::Authorized;
use crate::csv_response::csv_file;
use crate::extractors::Params;
use crate::problem_details::Refusal;
use crate::resources::document_schemas;
use crate::visible::Visible;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use gaitwright_charts::gait_table::gait_csv;
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_store::{StoreError, TrialId, gaits, other_local_optima, trials};
use serde::Deserialize;

/// Which gait of a trial.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LocalOptimumQuery {
    local_optimum: Option<u32>,
}

/// Get the gait of a trial
///
/// The trajectory in the format of the optimiser. A gait of another local optimum satisfies the bounds at the nodes.
#[utoipa::path(
    get,
    path = "/trials/{id}/gait",
    operation_id = "get_gait",
    tag = "trials",
    params(
        ("id" = TrialId, Path, description = "Identifier of the trial"),
        ("local_optimum" = Option<u32>, Query, description = "Number of another local optimum of the trial")
    ),
    responses((status = 200, description = "Gait", body = document_schemas::GaitDocument), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
    Params(LocalOptimumQuery { local_optimum }): Params<LocalOptimumQuery>,
) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    let gait = match local_optimum {
        None => gaits::get(&mut reader, id).await?,
        Some(number) => other_local_optima::get(&mut reader, id, number).await?.gait,
    };
    drop(reader);
    let text = app.compute(move |pool| gait.text(pool)).await??;
    Ok(([(header::CONTENT_TYPE, "application/json")], text).into_response())
}

/// Download the gait of a trial as CSV
///
/// Time, domain, coordinates and their derivatives, torques and ground forces; in a study with muscles, activations.
#[utoipa::path(
    get,
    path = "/trials/{id}/gait.csv",
    operation_id = "get_gait_csv",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses((status = 200, description = "One row for each node", body = String, content_type = "text/csv"), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get_csv(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    let number = trials::get(&mut reader, id).await?.number;
    let gait = gaits::get(&mut reader, id).await?;
    drop(reader);
    let table = move |pool: &OnPool| Ok::<_, StoreError>(gait_csv(&gait.unpack(pool)?));
    let table = app.compute(table).await??;
    Ok(csv_file(&format!("gait-trial-{number}.csv"), table))
}
