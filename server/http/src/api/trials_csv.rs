//! REST: all trials of a study as CSV.

use crate::AppState;
use crate::authorization::Authorized;
use crate::csv_response::csv_response;
use crate::problem_details::Refusal;
use crate::visible::Visible;
use axum::extract::State;
use axum::response::Response;
use gait_optimizer::TunedBounds;
use gaitwright_charts::csv_table::{CsvCell, CsvTable, cells};
use gaitwright_service::access::Read;
use gaitwright_store::{StudyId, TrialId, studies, trials};
use std::collections::HashMap;

/// Download trials as CSV
///
/// One row for each trial: the value of each bound, state, Gait RMSE, cost of transport, violation, iterations, time and
/// reason. Empty where there is no value yet.
#[utoipa::path(
    get,
    path = "/studies/{id}/trials.csv",
    operation_id = "get_trials_csv",
    tag = "trials",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "All trials, sorted by number", body = String, content_type = "text/csv"), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn download(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let all = trials::of_study(&mut reader, id).await?;
    drop(reader);
    csv_response(&mut app, &format!("trials-{}.csv", id.short()), move || written(&all)).await
}

fn written(all: &[trials::Trial]) -> CsvTable {
    let mut header = vec!["number", "trial_id"];
    header.extend(TunedBounds::NAMES);
    header.extend([
        "state",
        "gait_rmse_rad",
        "cost_of_transport",
        "mean_strides",
        "max_violation",
        "iterations",
        "seconds_total",
        "warm_started_from",
        "reason",
        "message",
    ]);
    let numbers: HashMap<TrialId, u32> = all.iter().map(|trial| (trial.id, trial.number)).collect();
    let mut table = CsvTable::new(header);
    for trial in all {
        let mut row = cells![trial.number, trial.id.to_string()];
        row.extend(trial.action.to_array().iter().map(CsvCell::from));
        row.extend(cells![
            trial.state.as_str(),
            trial.gait_rmse_rad,
            trial.cost_of_transport,
            trial.mean_strides,
            trial.max_violation,
            trial.iterations,
            trial.seconds_total,
            trial.warm_started_from.and_then(|id| numbers.get(&id)),
            &trial.reason,
            &trial.message,
        ]);
        table.row(row);
    }
    table
}
