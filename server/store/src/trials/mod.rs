//! Stored trials: actions of a study and their results.

mod label;
mod trial_counts;
mod trial_state;

pub use label::Label;
pub use trial_counts::{SolveTimes, TrialCounts, counts, improvements, measured};
pub use trial_state::TrialState;

use super::many_rows::read_many;
use super::{Connection, Instant, StoreError, StoreResult, StudyId, TrialId, json_columns, now};
use gait_learner::ActionIndex;
use gait_optimizer::{SolveReport, SolveStatus, TunedBounds, Violation};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// Trial of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Identifier.
    pub id: TrialId,
    /// Identifier of the study to which the trial belongs.
    pub study_id: StudyId,
    /// Number within the study, from 1, in the order of proposal.
    pub number: u32,
    /// Index of the action in the search space.
    pub action_index: ActionIndex,
    /// Action as bounds.
    pub action: TunedBounds,
    /// Reason for the trial.
    pub reason: String,
    /// Best trial when this one was proposed.
    pub best_before: Option<TrialId>,
    /// Trial whose gait is the warm start. Absent for a cold start.
    pub warm_started_from: Option<TrialId>,
    /// Script that evaluates the trial. Absent if the service does.
    pub script: Option<String>,
    /// State of the trial.
    pub state: TrialState,
    /// How the solve ended.
    pub status: Option<SolveStatus>,
    /// Gait RMSE of a gait, rad. If the trial did not converge, `report` has the Gait RMSE of the last
    /// iterate.
    pub gait_rmse_rad: Option<f64>,
    /// Cost of transport of a gait, dimensionless.
    pub cost_of_transport: Option<f64>,
    /// Mean strides of the simulated walks on which the result depends. Absent if it depends on none.
    pub mean_strides: Option<f64>,
    /// Objective of the solve.
    pub objective: Option<f64>,
    /// Largest violation, scaled.
    pub max_violation: Option<f64>,
    /// Interior-point iterations.
    pub iterations: Option<u32>,
    /// Wall time of the solve, s.
    pub seconds_total: Option<f64>,
    /// All numerical results of the solve.
    pub report: Option<SolveReport>,
    /// Most violated rows, worst first.
    pub violations: Vec<Violation>,
    /// Human-readable message about how the trial ended; may be empty.
    pub message: String,
    /// Time of proposal.
    pub created_at: Instant,
    /// Time at which a worker first started it.
    pub started_at: Option<Instant>,
    /// Time at which it ended.
    pub finished_at: Option<Instant>,
}

/// A proposed trial.
#[derive(Debug, Clone)]
pub struct NewTrial {
    /// Number within the study, from 1.
    pub number: u32,
    /// Index of the action in the search space.
    pub action_index: ActionIndex,
    /// Action as bounds.
    pub action: TunedBounds,
    /// Reason for the trial.
    pub reason: String,
    /// Best trial so far.
    pub best_before: Option<TrialId>,
    /// Trial whose gait is the warm start.
    pub warm_started_from: Option<TrialId>,
}

/// The end of a trial.
#[derive(Debug, Clone)]
pub struct TrialEnd {
    /// A state that is not open.
    pub state: TrialState,
    /// Figures of a completed solve.
    pub report: Option<SolveReport>,
    /// Mean strides of the simulated walks on which the result depends.
    pub mean_strides: Option<f64>,
    /// Most violated rows.
    pub violations: Vec<Violation>,
    /// Message for people; may be empty.
    pub message: String,
}

/// The result of a trial that a script reports.
#[derive(Debug, Clone)]
pub struct ReportedResult {
    /// Converged or not converged.
    pub label: Label,
    /// Gait RMSE, rad.
    pub gait_rmse_rad: Option<f64>,
    /// Cost of transport.
    pub cost_of_transport: Option<f64>,
    /// Why there is no gait; may be empty.
    pub message: String,
}

/// Adds a trial in state `queued`.
///
/// # Errors
/// A violated constraint (`trials_number_unique`); errors of the database.
pub async fn insert(db: &mut Connection, study: StudyId, new: &NewTrial) -> StoreResult<TrialId> {
    let id = TrialId::fresh();
    sqlx::query(
        "insert into trials (id, study_id, number, action_index, action, reason, best_before, warm_started_from, \
         state, created_at) values (?, ?, ?, ?, ?, ?, ?, ?, 'queued', ?)",
    )
    .bind(id)
    .bind(study)
    .bind(new.number)
    .bind(i64::try_from(new.action_index.0).unwrap_or(i64::MAX))
    .bind(json_columns::to_text("action", &new.action)?)
    .bind(&new.reason)
    .bind(new.best_before)
    .bind(new.warm_started_from)
    .bind(now())
    .execute(db)
    .await?;
    Ok(id)
}

/// The trial with this identifier.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn get(db: &mut Connection, id: TrialId) -> StoreResult<Trial> {
    let row = sqlx::query("select * from trials where id = ?").bind(id).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()?.ok_or_else(|| StoreError::Missing { what: "trial", id: id.to_string() })
}

/// Two trials, each of them if it exists.
///
/// # Errors
/// Errors of the database.
pub async fn pair(db: &mut Connection, (a, b): (TrialId, TrialId)) -> StoreResult<(Option<Trial>, Option<Trial>)> {
    let rows = sqlx::query("select * from trials where id in (?, ?)").bind(a).bind(b).fetch_all(db).await?;
    let found: Vec<Trial> = rows.iter().map(from_row).collect::<StoreResult<_>>()?;
    let of = |id| found.iter().find(|trial| trial.id == id).cloned();
    Ok((of(a), of(b)))
}

/// Every trial of a study, by number.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<Trial>> {
    page(db, study, 0, u32::MAX).await
}

/// The trials of a study with an action, by number.
///
/// # Errors
/// Errors of the database.
pub async fn of_action(db: &mut Connection, study: StudyId, action: ActionIndex) -> StoreResult<Vec<Trial>> {
    let rows = sqlx::query("select * from trials where study_id = ? and action_index = ? order by number")
        .bind(study)
        .bind(i64::try_from(action.0).unwrap_or(i64::MAX))
        .fetch_all(db)
        .await?;
    rows.iter().map(from_row).collect()
}

/// At most `limit` trials of a study with numbers above `after`, by number.
///
/// # Errors
/// Errors of the database.
pub async fn page(db: &mut Connection, study: StudyId, after: u32, limit: u32) -> StoreResult<Vec<Trial>> {
    let rows = sqlx::query("select * from trials where study_id = ? and number > ? order by number limit ?")
        .bind(study)
        .bind(after)
        .bind(limit)
        .fetch_all(db)
        .await?;
    read_many(&rows, from_row).await
}

/// At most `limit` trials of a study with numbers below `before`, by number: the newest of them.
///
/// # Errors
/// Errors of the database.
pub async fn newest(db: &mut Connection, study: StudyId, before: Option<u32>, limit: u32) -> StoreResult<Vec<Trial>> {
    let rows = sqlx::query(
        "select * from (select * from trials where study_id = ? and (? is null or number < ?) \
         order by number desc limit ?) order by number",
    )
    .bind(study)
    .bind(before)
    .bind(before)
    .bind(limit)
    .fetch_all(db)
    .await?;
    rows.iter().map(from_row).collect()
}

/// Sets the state to `running`.
///
/// # Errors
/// Errors of the database.
pub async fn start(db: &mut Connection, id: TrialId) -> StoreResult<()> {
    sqlx::query("update trials set state = 'running', started_at = coalesce(started_at, ?) where id = ?")
        .bind(now())
        .bind(id)
        .execute(db)
        .await?;
    Ok(())
}

/// Queues a trial again.
///
/// # Errors
/// Errors of the database.
pub async fn requeue(db: &mut Connection, id: TrialId, message: &str) -> StoreResult<()> {
    sqlx::query("update trials set state = 'queued', message = ?, finished_at = null where id = ?")
        .bind(message)
        .bind(id)
        .execute(db)
        .await?;
    Ok(())
}

/// Records the end of a trial.
///
/// # Errors
/// A refusal by a trigger if the trial already has a result; errors of the database.
pub async fn finish(db: &mut Connection, id: TrialId, end: &TrialEnd) -> StoreResult<()> {
    let solve_report = end.report.as_ref();
    // A figure that is not finite is stored as null.
    let finite = |f: fn(&SolveReport) -> f64| solve_report.map(f).filter(|x| x.is_finite());
    let status = solve_report.map(|r| json_columns::to_text("status", &r.status)).transpose()?;
    let report = solve_report.map(|r| json_columns::readable("report", r)).transpose()?.flatten();
    let violations: Vec<&Violation> = end.violations.iter().filter(|v| v.amount.is_finite()).collect();
    sqlx::query(
        "update trials set state = ?, status = ?, gait_rmse_rad = ?, cost_of_transport = ?, mean_strides = ?, objective = ?, \
         max_violation = ?, iterations = ?, seconds_total = ?, report = ?, violations = ?, message = ?, \
         finished_at = ? where id = ?",
    )
    .bind(end.state.as_str())
    .bind(status)
    .bind(finite(|r| r.gait_rmse_rad))
    .bind(finite(|r| r.cost_of_transport))
    .bind(end.mean_strides)
    .bind(finite(|r| r.objective))
    .bind(finite(|r| r.max_violation))
    .bind(solve_report.map(|r| i64::try_from(r.iterations).unwrap_or(i64::MAX)))
    .bind(finite(|r| r.seconds_total))
    .bind(report)
    .bind(json_columns::to_text("violations", &violations)?)
    .bind(&end.message)
    .bind(now())
    .bind(id)
    .execute(db)
    .await?;
    Ok(())
}

/// Assigns a new trial to a script.
///
/// # Errors
/// Errors of the database.
pub async fn assign(db: &mut Connection, id: TrialId, worker: &str) -> StoreResult<()> {
    sqlx::query("update trials set state = 'running', started_at = ?, script = ? where id = ?")
        .bind(now())
        .bind(worker)
        .bind(id)
        .execute(db)
        .await?;
    Ok(())
}

/// The open trial of a script in a study.
///
/// # Errors
/// Errors of the database.
pub async fn open_of(db: &mut Connection, study: StudyId, worker: &str) -> StoreResult<Option<TrialId>> {
    let row = sqlx::query("select id from trials where study_id = ? and state = 'running' and script = ?")
        .bind(study)
        .bind(worker)
        .fetch_optional(db)
        .await?;
    Ok(row.map(|row| row.try_get(0)).transpose()?)
}

/// Records the result that a script reports.
///
/// # Errors
/// A refusal by a trigger if the trial already has a result; errors of the database.
pub async fn tell(db: &mut Connection, id: TrialId, result: &ReportedResult) -> StoreResult<()> {
    sqlx::query(
        "update trials set state = ?, gait_rmse_rad = ?, cost_of_transport = ?, message = ?, finished_at = ? \
         where id = ?",
    )
    .bind(result.label.as_str())
    .bind(result.gait_rmse_rad)
    .bind(result.cost_of_transport)
    .bind(&result.message)
    .bind(now())
    .bind(id)
    .execute(db)
    .await?;
    Ok(())
}

/// A figure of a gait; `None` for trials without one, whose last iterate is not a gait.
pub(super) fn of_a_gait(row: &SqliteRow, state: TrialState, column: &str) -> StoreResult<Option<f64>> {
    let figure: Option<f64> = row.try_get(column)?;
    Ok(figure.filter(|_| state.has_gait()))
}

fn from_row(row: &SqliteRow) -> StoreResult<Trial> {
    let state = row.try_get::<&str, _>("state")?.parse()?;
    Ok(Trial {
        id: row.try_get("id")?,
        study_id: row.try_get("study_id")?,
        number: row.try_get("number")?,
        action_index: ActionIndex(u64::try_from(row.try_get::<i64, _>("action_index")?).unwrap_or(0)),
        action: json_columns::column(row, "action")?,
        reason: row.try_get("reason")?,
        best_before: row.try_get("best_before")?,
        warm_started_from: row.try_get("warm_started_from")?,
        script: row.try_get("script")?,
        state,
        status: json_columns::optional_column(row, "status")?,
        gait_rmse_rad: of_a_gait(row, state, "gait_rmse_rad")?,
        cost_of_transport: of_a_gait(row, state, "cost_of_transport")?,
        mean_strides: row.try_get("mean_strides")?,
        objective: row.try_get("objective")?,
        max_violation: row.try_get("max_violation")?,
        iterations: row.try_get("iterations")?,
        seconds_total: row.try_get("seconds_total")?,
        report: json_columns::optional_column(row, "report")?,
        violations: json_columns::optional_column(row, "violations")?.unwrap_or_default(),
        message: row.try_get("message")?,
        created_at: row.try_get("created_at")?,
        started_at: row.try_get("started_at")?,
        finished_at: row.try_get("finished_at")?,
    })
}
