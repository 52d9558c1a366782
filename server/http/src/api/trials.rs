//! Trials.

use crate::AppState;
use crate::extract::Params;
use crate::may::May;
use crate::negotiate::{csv_answer, wants_csv};
use crate::once::Once;
use crate::pages_of::After;
use crate::problem::Refusal;
use crate::reached::Id;
use crate::shown::Shown;
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use gait_optimizer::{IterationRecord, TunedBounds};
use gaitwright_charts::csv_table::{Cell, CsvTable, cells};
use gaitwright_service::access::{Read, Run};
use gaitwright_service::studies::command;
use gaitwright_store::results::{self, AttemptResult};
use gaitwright_store::trials::{self, Trial};
use gaitwright_store::{StudyId, TrialId, gaits, schema, studies};
use serde::Serialize;
use std::collections::HashMap;
use utoipa::ToSchema;

/// A page of trials.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct TrialPage {
    trials: Vec<Trial>,
    /// Give it as `after` to get the next page; absent on the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<u32>,
}

/// `GET /studies/{id}/trials`: by number, by pages; all of them as CSV.
#[utoipa::path(
    get,
    path = "/studies/{id}/trials",
    operation_id = "list_trials",
    tag = "trials",
    params(("id" = StudyId, Path, description = "The study"), ("after" = Option<u32>, Query, description = "After the trial with this number"), ("limit" = Option<u32>, Query, description = "At most so many: 1 to 1000")),
    responses((status = 200, description = "A page, by number; all of them as CSV where `Accept` asks for it", content((TrialPage = "application/json"), (String = "text/csv")))),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<StudyId, Read>,
    Params(page): Params<After<u32>>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    if wants_csv(&headers) {
        return table(&mut app, id).await;
    }
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let limit = page.limit_or(200, 1000)?;
    let mut found = trials::page(&mut reader, id, page.after.unwrap_or(0), limit + 1).await?;
    let more = found.len() > limit as usize;
    found.truncate(limit as usize);
    let next = if more { found.last().map(|trial| trial.number) } else { None };
    Ok(Json(TrialPage { trials: found, next }).into_response())
}

/// `GET /studies/{id}/trials.csv`.
#[utoipa::path(
    get,
    path = "/studies/{id}/trials.csv",
    operation_id = "list_trials_csv",
    tag = "trials",
    params(("id" = StudyId, Path, description = "The study")),
    responses((status = 200, description = "All of them", body = String, content_type = "text/csv")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study_csv(
    _: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<StudyId, Read>,
) -> Result<Response, Refusal> {
    table(&mut app, id).await
}

/// `GET /trials/{id}`.
#[utoipa::path(
    get,
    path = "/trials/{id}",
    operation_id = "get_trial",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial")),
    responses((status = 200, description = "The trial", body = Trial)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<TrialId, Read>,
) -> Result<Json<Trial>, Refusal> {
    Ok(Json(trials::get(&mut *app.read().await?, id).await?))
}

/// `POST /trials/{id}/cancel`.
#[utoipa::path(
    post,
    path = "/trials/{id}/cancel",
    operation_id = "cancel_trial",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial")),
    responses((status = 200, description = "Cancelled; its solve stops within one iteration", body = Trial)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn cancel(
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    once: Once<Run>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let trial = command::cancel(&mut writer, &once.actor, id, "cancelled on request").await?;
    let answer = once.finish(&app, writer, StatusCode::OK, None, &trial).await?;
    app.scheduler.cancel_solve(id).await;
    Ok(answer)
}

/// `POST /trials/{id}/retry`.
#[utoipa::path(
    post,
    path = "/trials/{id}/retry",
    operation_id = "retry_trial",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial")),
    responses((status = 200, description = "Queued once more", body = Trial)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn retry(
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    once: Once<Run>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let trial = command::retry(&mut writer, &once.actor, id).await?;
    once.finish(&app, writer, StatusCode::OK, None, &trial).await
}

/// `GET /trials/{id}/iterations`: of the running solve, or as recorded.
#[utoipa::path(
    get,
    path = "/trials/{id}/iterations",
    operation_id = "list_iterations",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial")),
    responses((status = 200, description = "Of the running solve, or as recorded", body = Vec<schema::Iteration>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn iterations(
    _: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<TrialId, Read>,
) -> Result<Json<Vec<IterationRecord>>, Refusal> {
    if let Some(track) = app.scheduler.board().track(id) {
        return Ok(Json(track.records));
    }
    let iterations = gaits::iterations(&mut *app.read().await?, id).await?;
    Ok(Json(app.compute(move |pool| iterations.unpack(pool)).await??))
}

/// `GET /trials/{id}/attempts`: what workers brought, also what came too late to count.
#[utoipa::path(
    get,
    path = "/trials/{id}/attempts",
    operation_id = "list_attempts",
    tag = "trials",
    params(("id" = TrialId, Path, description = "The trial")),
    responses((status = 200, description = "By attempt", body = Vec<AttemptResult>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn attempts(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<TrialId, Read>,
) -> Result<Json<Vec<AttemptResult>>, Refusal> {
    Ok(Json(results::of_trial(&mut *app.read().await?, id).await?))
}

async fn table(app: &mut AppState, id: StudyId) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let all = trials::of_study(&mut reader, id).await?;
    drop(reader);
    csv_answer(app, &format!("trials-{}.csv", id.short()), move || written(&all)).await
}

fn written(all: &[Trial]) -> CsvTable {
    let mut header = vec!["number", "trial_id"];
    header.extend(TunedBounds::NAMES);
    header.extend([
        "state",
        "gait_rmse_rad",
        "cost_of_transport",
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
        row.extend(trial.action.to_array().iter().map(Cell::from));
        row.extend(cells![
            trial.state.as_str(),
            trial.gait_rmse_rad,
            trial.cost_of_transport,
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
