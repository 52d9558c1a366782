//! Checkpoints: merging the write-ahead log into the database file.
//!
//! A long log takes tens of milliseconds to merge. Most of it is therefore merged on a second connection while changes
//! go on; only the rest, which they have added meanwhile, is merged between two changes.

use super::StoreResult;
use sqlx::{Connection as _, Row as _, SqliteConnection};

/// A log with this number of frames is merged.
pub(super) const LONGEST_LOG: u32 = 4000;

/// The connection for checkpoints; `None` after closing.
#[derive(Debug)]
pub(super) struct Aside(tokio::sync::Mutex<Option<SqliteConnection>>);

impl Aside {
    /// Takes over a connection.
    pub(super) fn new(connection: SqliteConnection) -> Self {
        Self(Some(connection).into())
    }

    /// Merges what is in the log now. Returns `false` after closing.
    pub(super) async fn merge(&self) -> bool {
        match self.0.lock().await.as_mut() {
            Some(connection) => merge(connection).await,
            None => return false,
        }
        true
    }

    /// Waits for the current checkpoint, and closes the connection.
    pub(super) async fn close(&self) {
        if let Some(connection) = self.0.lock().await.take()
            && let Err(error) = connection.close().await
        {
            tracing::warn!(%error, "cannot close the connection for checkpoints");
        }
    }
}

/// Merges the log into the database file.
pub(super) async fn merge(connection: &mut SqliteConnection) {
    if let Err(error) = sqlx::query("pragma wal_checkpoint(passive)").execute(connection).await {
        tracing::error!(%error, "cannot save the write-ahead log to the database file");
    }
}

/// Number of frames in the log.
pub(super) async fn log_frames(connection: &mut SqliteConnection) -> StoreResult<u32> {
    let row = sqlx::query("pragma wal_checkpoint(noop)").fetch_one(connection).await?;
    Ok(row.try_get("log")?)
}
