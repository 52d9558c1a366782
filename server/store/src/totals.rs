//! Totals of the record for metrics: studies, trials and solve jobs by state, and the size of the file.

use super::{Connection, Instant, StoreResult, now};
use sqlx::Row;

/// Totals over the whole record.
#[derive(Debug, Clone, PartialEq)]
pub struct Totals {
    /// Studies by state.
    pub studies: Vec<(String, i64)>,
    /// Trials by state.
    pub trials: Vec<(String, i64)>,
    /// Jobs by state.
    pub solve_jobs: Vec<(String, i64)>,
    /// Size of the file.
    pub bytes: i64,
    /// Waiting time of the oldest queued job, s.
    pub oldest_queued_seconds: f64,
}

/// Reads the totals.
///
/// # Errors
/// Errors of the database.
pub async fn read(db: &mut Connection) -> StoreResult<Totals> {
    let bytes = sqlx::query("select page_count * page_size from pragma_page_count(), pragma_page_size()")
        .fetch_one(&mut *db)
        .await?
        .try_get(0)?;
    let oldest: Option<Instant> = sqlx::query("select min(created_at) from solve_jobs where state = 'queued'")
        .fetch_one(&mut *db)
        .await?
        .try_get(0)?;
    Ok(Totals {
        studies: by_state(db, "select state, count(*) from studies group by state").await?,
        trials: by_state(db, "select state, count(*) from trials group by state").await?,
        solve_jobs: by_state(db, "select state, count(*) from solve_jobs group by state").await?,
        bytes,
        oldest_queued_seconds: oldest.map_or(0.0, |at| now().seconds_since(at)),
    })
}

async fn by_state(db: &mut Connection, sql: &'static str) -> StoreResult<Vec<(String, i64)>> {
    let rows = sqlx::query(sql).fetch_all(db).await?;
    rows.iter().map(|row| Ok((row.try_get(0)?, row.try_get(1)?))).collect()
}
