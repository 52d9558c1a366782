//! Background task that deletes expired idempotency keys, sessions and sign-in links. All other data, events included,
//! is kept forever.

use crate::error::Error;
use crate::supervise::Task;
use gaitwright_store::{Store, commit, idempotency, now, sessions};
use std::time::Duration;

/// Days for which the response to an Idempotency-Key is kept. No client retries longer than that.
pub const IDEMPOTENCY_KEY_DAYS: i64 = 7;
/// Days after which ended or idle sessions, and used or expired links, are deleted. The audit trail keeps the sign-ins.
pub const SESSION_DAYS: i64 = 90;
/// Time between two rounds.
const CLEANUP_INTERVAL: Duration = Duration::from_hours(1);
const DAY_S: i64 = 86_400;

/// How much a round deleted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DeletedCounts {
    /// Stored responses to requests with an Idempotency-Key.
    pub answers: u64,
    /// Sessions.
    pub sessions: u64,
    /// One-time links.
    pub links: u64,
}

/// Deletes everything that has expired.
///
/// # Errors
/// Errors of the database.
pub async fn delete_expired(store: &Store) -> Result<DeletedCounts, Error> {
    let present = now();
    let long_ago = present.plus_seconds(-SESSION_DAYS * DAY_S);
    let mut writer = store.write().await?;
    let dropped = DeletedCounts {
        answers: idempotency::drop_before(&mut writer, present.plus_seconds(-IDEMPOTENCY_KEY_DAYS * DAY_S)).await?,
        sessions: sessions::drop_before(&mut writer, long_ago).await?,
        links: sessions::drop_links_before(&mut writer, long_ago).await?,
    };
    commit(writer).await?;
    Ok(dropped)
}

/// Deletes everything that has expired, now and every hour. A failed round is logged, and the next one tries again.
///
/// # Errors
/// None: failures are logged.
pub async fn delete_expired_hourly(store: Store, task: Task) -> Result<(), Error> {
    loop {
        task.works();
        match delete_expired(&store).await {
            Ok(DeletedCounts { answers: 0, sessions: 0, links: 0 }) => {}
            Ok(DeletedCounts { answers, sessions, links }) => {
                tracing::info!(answers, sessions, links, "deleted expired data");
            }
            Err(error) => tracing::warn!(%error, "cannot delete expired data"),
        }
        tokio::time::sleep(CLEANUP_INTERVAL).await;
    }
}
