//! Stored attempts at trials, with their results, including results that arrived too late.

use super::{Connection, Instant, StoreResult, TrialId, json_columns, now};
use gait_optimizer::{SolveReport, SolveStatus};
use sqlx::Row;

/// Result of an attempt.
#[derive(Debug, Clone, PartialEq)]
pub struct AttemptResult {
    /// Number of the attempt, from 1.
    pub attempt: u32,
    /// Name of the worker.
    pub worker: String,
    /// Whether it became the result of the trial. Otherwise it arrived too late and is kept as evidence.
    pub used: bool,
    /// How the solve ended.
    pub status: SolveStatus,
    /// Numerical results of the solve, without those that are not finite.
    pub report: Option<SolveReport>,
    /// Time of arrival.
    pub received_at: Instant,
}

/// Stores a result. Returns `false` if the attempt already has one.
///
/// # Errors
/// Errors of the database.
pub async fn insert(
    db: &mut Connection,
    (trial, attempt): (TrialId, u32),
    worker: &str,
    report: &SolveReport,
    used: bool,
) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into attempts (trial_id, attempt, worker, used, status, report, received_at) \
         values (?, ?, ?, ?, ?, ?, ?) on conflict do nothing",
    )
    .bind(trial)
    .bind(attempt)
    .bind(worker)
    .bind(used)
    .bind(json_columns::to_text("status", &report.status)?)
    .bind(json_columns::readable("report", report)?)
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() == 1)
}

/// The results of a trial, by attempt.
///
/// # Errors
/// Errors of the database.
pub async fn of_trial(db: &mut Connection, trial: TrialId) -> StoreResult<Vec<AttemptResult>> {
    let rows =
        sqlx::query("select * from attempts where trial_id = ? order by attempt").bind(trial).fetch_all(db).await?;
    rows.iter()
        .map(|row| {
            Ok(AttemptResult {
                attempt: row.try_get("attempt")?,
                worker: row.try_get("worker")?,
                used: row.try_get("used")?,
                status: json_columns::column(row, "status")?,
                report: json_columns::optional_column(row, "report")?,
                received_at: row.try_get("received_at")?,
            })
        })
        .collect()
}
