//! Reads many rows without blocking other tasks of the thread.

use super::StoreResult;
use sqlx::sqlite::SqliteRow;
use tokio::task::coop::consume_budget;

/// Converts rows in order, and yields to other tasks in between, because parsing thousands of rows with JSON takes
/// long.
pub(super) async fn read_many<T>(
    rows: &[SqliteRow],
    read: impl Fn(&SqliteRow) -> StoreResult<T>,
) -> StoreResult<Vec<T>> {
    let mut found = Vec::with_capacity(rows.len());
    for row in rows {
        found.push(read(row)?);
        consume_budget().await;
    }
    Ok(found)
}
