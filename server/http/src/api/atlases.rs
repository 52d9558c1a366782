//! REST: the atlas that a study makes.

use crate::AppState;
use crate::authorization::Authorized;
use crate::csv_response::csv_response;
use crate::problem_details::Refusal;
use crate::resources::atlases::Atlas;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_charts::csv_table::{CsvCell, CsvTable, cells};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::atlas::{AtlasResult, GaitValues, StudyAtlas};
use gaitwright_store::studies::StudyPlan;
use gaitwright_store::{StudyId, TrialId, certificates, gaits, reference_gaits, studies, trials};
use std::collections::HashMap;

/// Get the atlas of a study
///
/// How many actions have a result, and the best gait so far. Start an atlas with `POST /studies/{id}/clone` and `atlas` `make`;
/// the commands for studies pause, resume and stop it.
#[utoipa::path(
    get,
    path = "/studies/{id}/atlas",
    operation_id = "get_atlas",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "Progress and best gait", body = Atlas), (status = 409, description = "The study makes no atlas, or the subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
) -> Result<Json<Atlas>, Refusal> {
    let (_, atlas) = read(&mut app, id).await?;
    let certified = certificates::of_study(&mut *app.read().await?, id).await?;
    Ok(Json(Atlas::of(&atlas, &certified)))
}

/// Download the atlas as CSV
///
/// The bounds of each action that has a result, and the gait that it has. Of a gait that the record no longer has, or from
/// which nothing can be computed, only the results of its solve are given.
#[utoipa::path(
    get,
    path = "/studies/{id}/atlas.csv",
    operation_id = "get_atlas_csv",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "One row for each action that has a result", body = String, content_type = "text/csv"), (status = 409, description = "The study makes no atlas, or the subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get_csv(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
) -> Result<Response, Refusal> {
    let (plan, atlas) = read(&mut app, id).await?;
    let mut reader = app.read().await?;
    let reference = reference_gaits::get(&mut reader, plan.reference_gait_id).await?.definition;
    let mut found = Vec::new();
    for AtlasResult { trial, .. } in atlas.by_gait_rmse() {
        if let (Some(report), Some(gait)) = (&trial.report, gaits::find(&mut reader, trial.id).await?) {
            found.push((trial.id, report.clone(), gait));
        }
    }
    drop(reader);
    let values = move |pool: &OnPool| {
        let mut values = HashMap::new();
        for (trial, report, gait) in found {
            if let Ok(gait) = GaitValues::of(&report, &gait.unpack(pool)?, &reference) {
                values.insert(trial, gait);
            }
        }
        Ok::<_, Error>(values)
    };
    let values = app.compute(values).await??;
    csv_response(&mut app, &format!("atlas-{}.csv", id.short()), move || table(&plan, &atlas, &values)).await
}

async fn read(app: &mut AppState, id: StudyId) -> Result<(StudyPlan, StudyAtlas), Refusal> {
    let mut reader = app.read().await?;
    let plan = studies::get(&mut reader, id).await?.plan;
    let trials = trials::of_study(&mut reader, id).await?;
    drop(reader);
    let follow = move |pool: &OnPool| {
        let atlas = StudyAtlas::of(pool, &plan, &trials);
        atlas.map(|atlas| (plan, atlas))
    };
    Ok(app.compute(follow).await??)
}

/// The columns after the action, without those of the gait. Scripts rely on them. Actions with the same gait number share a
/// gait.
const COLUMNS: [&str; 4] = ["gait", "trial", "status", "iterations"];

/// The table. A pruned or malformed gait has solve results only.
fn table(plan: &StudyPlan, atlas: &StudyAtlas, values: &HashMap<TrialId, GaitValues>) -> CsvTable {
    let mut table = CsvTable::default();
    let bounds = plan.search_space.dimensions().iter().map(|dimension| dimension.name.as_str());
    let columns = COLUMNS.into_iter().chain(GaitValues::COLUMNS).chain(["active"]);
    table.row(bounds.chain(columns).map(CsvCell::from));
    for result in atlas.results() {
        let trial = result.trial;
        let mut row: Vec<CsvCell> = plan.search_space.values(result.action).iter().map(CsvCell::from).collect();
        row.extend(cells![result.gait, trial.number, trial.state.as_str(), trial.iterations]);
        let mut numbers = [None; GaitValues::COLUMNS.len()];
        if result.gait.is_some() {
            numbers[..3].copy_from_slice(&[trial.objective, trial.cost_of_transport, trial.gait_rmse_rad]);
            numbers = values.get(&trial.id).map_or(numbers, GaitValues::numbers);
        }
        row.extend(numbers.map(CsvCell::from));
        row.push(CsvCell::from(result.active_bounds().join(" ")));
        table.row(row);
    }
    table
}
