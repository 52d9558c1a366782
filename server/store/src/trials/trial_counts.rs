//! How far the trials of a study are, and how long solves take.

use crate::{Connection, StoreResult, StudyId};
use sqlx::Row;

/// Numbers of trials of a study by state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TrialCounts {
    /// All trials.
    pub total: u32,
    /// Queued or running trials.
    pub open: u32,
    /// Converged trials.
    pub converged: u32,
    /// Trials that did not converge.
    pub not_converged: u32,
    /// Trials with a gait that is not executable.
    pub not_executable: u32,
    /// Failed, lost or cancelled trials.
    pub without_result: u32,
}

impl TrialCounts {
    /// Number of trials with a result.
    pub fn results(&self) -> u32 {
        self.converged + self.not_converged + self.not_executable
    }
}

/// Counts the trials of a study.
///
/// # Errors
/// Errors of the database.
pub async fn counts(db: &mut Connection, study: StudyId) -> StoreResult<TrialCounts> {
    let row = sqlx::query(
        "with counted as (select state, count(*) as trials from trials where study_id = ? group by state) \
         select coalesce(sum(trials), 0) as total, \
         coalesce(sum(iif(state in ('queued', 'running'), trials, 0)), 0) as open, \
         coalesce(sum(iif(state = 'converged', trials, 0)), 0) as converged, \
         coalesce(sum(iif(state = 'not_converged', trials, 0)), 0) as not_converged, \
         coalesce(sum(iif(state = 'not_executable', trials, 0)), 0) as not_executable, \
         coalesce(sum(iif(state in ('failed', 'lost', 'cancelled'), trials, 0)), 0) as without_result \
         from counted",
    )
    .bind(study)
    .fetch_one(db)
    .await?;
    Ok(TrialCounts {
        total: row.try_get("total")?,
        open: row.try_get("open")?,
        converged: row.try_get("converged")?,
        not_converged: row.try_get("not_converged")?,
        not_executable: row.try_get("not_executable")?,
        without_result: row.try_get("without_result")?,
    })
}

/// The converged trials of a study with a lower Gait RMSE than all earlier ones: number and Gait RMSE, rad.
///
/// # Errors
/// Errors of the database.
pub async fn improvements(db: &mut Connection, study: StudyId) -> StoreResult<Vec<(u32, f64)>> {
    let rows = sqlx::query(
        "select number, gait_rmse_rad from (select number, gait_rmse_rad, \
         min(gait_rmse_rad) over (order by number rows between unbounded preceding and current row) as best \
         from trials where study_id = ? and state = 'converged') where gait_rmse_rad = best order by number",
    )
    .bind(study)
    .fetch_all(db)
    .await?;
    rows.iter().map(|row| Ok((row.try_get(0)?, row.try_get(1)?))).collect()
}

/// Solve times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveTimes {
    /// Number of solves.
    pub solves: usize,
    /// Median of their wall times, s.
    pub median_seconds: f64,
}

/// The times of the newest solves, at most 200, with or without muscles; `None` before the first solve.
///
/// # Errors
/// Errors of the database.
pub async fn measured(db: &mut Connection, muscles: bool) -> StoreResult<Option<SolveTimes>> {
    let rows = sqlx::query(
        "select seconds_total from (select t.seconds_total from trials t join studies s on s.id = t.study_id \
         where s.muscles = ? and t.seconds_total is not null and t.state in ('converged', 'not_converged', 'not_executable') \
         order by t.id desc limit 200) order by seconds_total",
    )
    .bind(muscles)
    .fetch_all(db)
    .await?;
    let Some(middle) = rows.get(rows.len() / 2) else { return Ok(None) };
    Ok(Some(SolveTimes { solves: rows.len(), median_seconds: middle.try_get(0)? }))
}
