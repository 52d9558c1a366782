//! What the record keeps only for a while: answers to requests that may be repeated, sessions that ended, links that were
//! used. Everything that says what was measured, answered, decided or allowed is kept, events among it.

use crate::error::Error;
use crate::supervise::Task;
use gaitwright_store::{Store, commit, idempotency, now, sessions};
use std::time::Duration;

/// Answers to requests with an Idempotency-Key are kept so many days: a client that retries later has given up before.
pub const IDEMPOTENCY_KEY_DAYS: i64 = 7;
/// Sessions that ended or were idle for so many days are dropped, and links that were used or expired so long ago. The
/// audit trail keeps who signed in.
pub const SESSION_DAYS: i64 = 90;
/// Between two rounds.
const EVERY: Duration = Duration::from_hours(1);
const DAY_S: i64 = 86_400;

/// What a round dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dropped {
    /// Answers to requests that may be repeated.
    pub answers: u64,
    /// Sessions.
    pub sessions: u64,
    /// One-time links.
    pub links: u64,
}

/// Drops what is past its time.
///
/// # Errors
/// What the database reports.
pub async fn drop_expired(store: &Store) -> Result<Dropped, Error> {
    let present = now();
    let long_ago = present.plus_seconds(-SESSION_DAYS * DAY_S);
    let mut writer = store.write().await?;
    let dropped = Dropped {
        answers: idempotency::drop_before(&mut writer, present.plus_seconds(-IDEMPOTENCY_KEY_DAYS * DAY_S)).await?,
        sessions: sessions::drop_before(&mut writer, long_ago).await?,
        links: sessions::drop_links_before(&mut writer, long_ago).await?,
    };
    commit(writer).await?;
    Ok(dropped)
}

/// Drops what is past its time, now and every hour; what fails is tried again in the next round.
///
/// # Errors
/// None: what fails is logged.
pub async fn keep_dropping(store: Store, task: Task) -> Result<(), Error> {
    loop {
        task.works();
        match drop_expired(&store).await {
            Ok(Dropped { answers: 0, sessions: 0, links: 0 }) => {}
            Ok(Dropped { answers, sessions, links }) => {
                tracing::info!(answers, sessions, links, "dropped what is past its time");
            }
            Err(error) => tracing::warn!(%error, "cannot drop what is past its time"),
        }
        tokio::time::sleep(EVERY).await;
    }
}
