//! REST: the history of the recommendation.

use crate::AppState;
use crate::authorization::Authorized;
use crate::csv_response::csv_response;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_charts::csv_table::{CsvTable, cells};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::history::{self, HistoryEntry};
use gaitwright_service::studies::recommended_trial::ranking_to_show;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::{StudyId, studies};
use std::sync::Arc;

/// List the history of the recommendation
///
/// The best trial after each iteration of the study, that is, after each result. Sorted by iteration.
#[utoipa::path(
    get,
    path = "/studies/{id}/history",
    operation_id = "list_study_history",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "A page, in order of iterations", body = Page<HistoryEntry>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    paging: Paging<u32>,
) -> Result<Json<Page<HistoryEntry>>, Refusal> {
    Ok(Json(paging.cut(read(&mut app, id).await?, |milestone| milestone.iteration)?))
}

/// Download the history as CSV
///
/// The best trial after each iteration of the study, that is, after each result.
#[utoipa::path(
    get,
    path = "/studies/{id}/history.csv",
    operation_id = "get_study_history_csv",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "One row for each iteration of the study", body = String, content_type = "text/csv"), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study_csv(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
) -> Result<Response, Refusal> {
    table(&mut app, id).await
}

async fn read(app: &mut AppState, id: StudyId) -> Result<Vec<HistoryEntry>, Refusal> {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let snapshot = StudySnapshot::read(&mut reader, study).await?;
    drop(reader);
    let analyses = Arc::clone(&app.analyses);
    let compute = move |pool: &OnPool| {
        let best = ranking_to_show(pool, &snapshot, &analyses)?.first().copied();
        Ok(history::of(&snapshot, best))
    };
    app.compute(compute).await?.map_err(Error::Learner).map_err(Refusal)
}

async fn table(app: &mut AppState, id: StudyId) -> Result<Response, Refusal> {
    let history = read(app, id).await?;
    csv_response(app, &format!("history-{}.csv", id.short()), move || written(&history)).await
}

fn written(history: &[HistoryEntry]) -> CsvTable {
    let mut table = CsvTable::new(["iteration", "best_trial", "gait_rmse_rad", "cost_of_transport"]);
    for m in history {
        table.row(cells![m.iteration, m.number, m.gait_rmse_rad, m.cost_of_transport]);
    }
    table
}
