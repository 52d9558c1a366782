//! Notices that another program wrote to the record while this one owns it.

use super::StoreResult;
use super::lost_files::RecordFiles;
use sqlx::SqliteConnection;

/// A number that differs from the last one if another connection has committed in between.
pub(super) async fn data_version(connection: &mut SqliteConnection) -> StoreResult<i64> {
    Ok(sqlx::query_scalar("pragma data_version").fetch_one(connection).await?)
}

/// Refuses a record that another program has changed since the data version `seen`. Called after the beginning of a
/// transaction, when no other program can write. Returns the present data version.
pub(super) async fn refuse(
    connection: &mut SqliteConnection,
    files: Option<&RecordFiles>,
    seen: Option<i64>,
) -> StoreResult<i64> {
    let version = data_version(connection).await?;
    match files {
        Some(files) if seen.is_some_and(|seen| seen != version) => Err(files.refuse_second_writer()),
        _ => Ok(version),
    }
}
