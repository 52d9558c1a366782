//! REST: trials.

use super::jobs::Job;
use super::sort_column::column_and_direction;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::Idempotent;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::solve_reports::Iteration;
use crate::resources::trials::{AttemptResult, Trial};
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gait_optimizer::IterationRecord;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::job::JobId;
use gaitwright_service::studies::cancelled_trial;
use gaitwright_service::studies::command;
use gaitwright_store::trial_list::{self, ListStart, Listing, RANGES, SORTS, TrialPlace, ValueRange};
use gaitwright_store::trials::{self, TrialState};
use gaitwright_store::{StudyId, TrialId, attempts, gaits, studies};
use serde::de::{Deserialize, Deserializer, Error as _};

/// Filter and order of trials.
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TrialQuery {
    state: Option<TrialState>,
    #[serde(default)]
    sort: Sort,
    range: Option<RangeColumn>,
    at_least: Option<f64>,
    at_most: Option<f64>,
}

impl TrialQuery {
    fn range(&self) -> Result<Option<ValueRange>, Error> {
        let ends = [("at_least", self.at_least), ("at_most", self.at_most)];
        for (name, end) in ends {
            if let Some(end) = end.filter(|end| !end.is_finite()) {
                return Err(Error::invalid(name, end.to_string(), "a finite number"));
            }
        }
        let Some(RangeColumn(column)) = self.range else {
            let given = ends.into_iter().find_map(|(name, end)| Some((name, end?)));
            return given.map_or(Ok(None), |(name, end)| Err(Error::invalid(name, end, "absent without range")));
        };
        let (from, to) = (self.at_least.unwrap_or(f64::MIN), self.at_most.unwrap_or(f64::MAX));
        Ok(Some(ValueRange { column, from, to }))
    }
}

/// The column whose range filters the list.
#[derive(Debug, Clone, Copy)]
struct RangeColumn(&'static str);

impl<'de> Deserialize<'de> for RangeColumn {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let column = RANGES.into_iter().find(|column| *column == name);
        column.map(Self).ok_or_else(|| D::Error::custom(format!("one of {}", RANGES.join(", "))))
    }
}

/// The column to sort by. A leading minus sorts in descending order.
#[derive(Debug, Clone, Copy)]
struct Sort {
    column: &'static str,
    descending: bool,
}

impl Default for Sort {
    fn default() -> Self {
        Self { column: SORTS[0], descending: false }
    }
}

impl<'de> Deserialize<'de> for Sort {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let sort = String::deserialize(deserializer)?;
        let (column, descending) = column_and_direction(&sort, &SORTS, |name| name).map_err(D::Error::custom)?;
        Ok(Self { column, descending })
    }
}

/// List trials of a study
///
/// Sorted by number, unless `sort` names another column. A trial whose value in that column changes while a client reads
/// the pages can be missing or occur twice. The number of a trial never changes.
#[utoipa::path(
    get,
    path = "/studies/{id}/trials",
    operation_id = "list_trials",
    tag = "trials",
    params(
        ("id" = StudyId, Path, description = "Identifier of the study"),
        ("state" = Option<TrialState>, Query, description = "Only trials in this state"),
        ("sort" = Option<String>, Query, description = "Column to sort by, such as `gait_rmse_rad`. A leading minus sorts in descending order. Trials without a value come last"),
        ("range" = Option<String>, Query, description = "Only trials whose value in this column is between `at_least` and `at_most`. Trials without a value are left out"),
        ("at_least" = Option<f64>, Query, description = "Minimum in the column `range`, in the unit of the column. Without it, the range has no lower end"),
        ("at_most" = Option<f64>, Query, description = "Maximum in the column `range`. Without it, the range has no upper end")
    ),
    responses((status = 200, description = "A page", body = Page<Trial>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    paging: Paging<TrialPlace, TrialQuery>,
) -> Result<Json<Page<Trial>>, Refusal> {
    let TrialQuery { state, sort, .. } = paging.filter;
    let range = paging.filter.range()?;
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let listing = Listing {
        sort: sort.column,
        descending: sort.descending,
        state,
        contains: String::new(),
        range,
        limit: paging.to_read(),
        start: paging.after.clone().map_or(ListStart::First, ListStart::After),
    };
    let listed = trial_list::of_study(&mut reader, id, &listing).await?;
    let (listed, next) = paging.page(listed, |trial| trial.place.clone())?.into_parts();
    let mut found = Vec::with_capacity(listed.len());
    for trial in listed {
        found.push(trials::get(&mut reader, trial.id).await?.into());
    }
    Ok(Json(Page::of_parts(found, next)))
}

/// Get a trial
///
/// The action, state, reason and result of the trial. Values that do not exist are null.
#[utoipa::path(
    get,
    path = "/trials/{id}",
    operation_id = "get_trial",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses((status = 200, description = "Trial", body = Trial), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
) -> Result<Json<Trial>, Refusal> {
    Ok(Json(trials::get(&mut *app.read().await?, id).await?.into()))
}

/// Cancel a trial
///
/// The solve stops within one iteration.
#[utoipa::path(
    post,
    path = "/trials/{id}/cancel",
    operation_id = "cancel_trial",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses((status = 200, description = "Cancelled trial", body = Trial)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn cancel(
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    request: Idempotent<Run>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let trial = cancelled_trial::cancel(&mut writer, &request.actor, id, "Cancelled on request.").await?;
    let answer = request.done(&app, writer, &Trial::from(trial)).await?;
    app.scheduler.cancel_solve(id).await;
    Ok(answer)
}

/// Retry a trial
///
/// Requeues a trial that ended without a result. The job of its solve can be followed and cancelled.
#[utoipa::path(
    post,
    path = "/trials/{id}/retry",
    operation_id = "retry_trial",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses((status = 202, description = "Job that solves the trial", body = Job)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn retry(
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    request: Idempotent<Run>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    command::retry(&mut writer, &request.actor, id).await?;
    Job::respond(&request, &app, writer, JobId::Solve(id)).await
}

/// List iterations of a solve
///
/// The iterations of the running solve so far, or the recorded ones of a solve that has ended. Sorted by
/// iteration.
#[utoipa::path(
    get,
    path = "/trials/{id}/iterations",
    operation_id = "list_iterations",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses((status = 200, description = "Iterations", body = Page<Iteration>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn iterations(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
    paging: Paging<(usize, usize)>,
) -> Result<Json<Page<Iteration>>, Refusal> {
    let records = if let Some(track) = app.scheduler.running_solves().track(id) {
        track.records
    } else {
        let iterations = gaits::iterations(&mut *app.read().await?, id).await?;
        app.compute(move |pool| iterations.unpack(pool)).await??
    };
    // The phases of a solve share an iteration: the last one of a phase is the start of the next.
    let mut numbered: Vec<((usize, usize), IterationRecord)> = Vec::with_capacity(records.len());
    for record in records {
        let earlier = numbered.last().filter(|((iteration, _), _)| *iteration == record.iteration);
        let repeat = earlier.map_or(0, |((_, repeat), _)| repeat + 1);
        numbered.push(((record.iteration, repeat), record));
    }
    Ok(Json(paging.cut(numbered, |(key, _)| *key)?.map(|(_, record)| Iteration::from(record))))
}

/// List attempts at a trial
///
/// Results delivered by workers, including results that arrived too late to count. Sorted by attempt.
#[utoipa::path(
    get,
    path = "/trials/{id}/attempts",
    operation_id = "list_attempts",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses((status = 200, description = "Attempts", body = Page<AttemptResult>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn attempts(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
    paging: Paging<u32>,
) -> Result<Json<Page<AttemptResult>>, Refusal> {
    let results = attempts::of_trial(&mut *app.read().await?, id).await?;
    Ok(Json(paging.cut(results, |attempt| attempt.attempt)?.map(AttemptResult::from)))
}
