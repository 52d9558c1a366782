//! Reading many rows at a time.

use super::StoreResult;
use sqlx::sqlite::SqliteRow;
use tokio::task::coop::consume_budget;

/// What rows say, in their order. Reading thousands of rows with JSON in them takes as long as hundreds of requests: the
/// other tasks of the thread have their turn in between.
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
