//! The rows of the access log that are not written yet.

use gaitwright_service::error::Error;
use gaitwright_store::access_log::{self, Access, AccessKind, Tally};
use gaitwright_store::{Store, StoreResult, access_spool, commit, now};
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time within which repeated requests share a row.
const REPEAT_WINDOW: Duration = Duration::from_mins(1);
/// Number of rows per transaction, so that others do not wait long for the writer.
const ROWS_PER_TRANSACTION: usize = 50;
/// Number of unwritten rows beyond which refusals of unknown callers share a row.
const MAX_WAITING: usize = 1000;

/// The rows that are not written yet.
#[derive(Debug, Default)]
pub struct AccessLog(Mutex<UnwrittenRows>);

#[derive(Debug, Default)]
struct UnwrittenRows {
    rows: HashMap<Access, Tally>,
    /// When each row was last written.
    written: HashMap<Access, Instant>,
    /// A background task writes the queued rows.
    is_kept: bool,
}

impl AccessLog {
    fn waiting(&self) -> MutexGuard<'_, UnwrittenRows> {
        // The rows are consistent between statements, so a poisoned lock is usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts an access. Returns whether the writing task must be started.
    pub(crate) fn count(&self, mut access: Access) -> bool {
        let mut waiting = self.waiting();
        if waiting.rows.len() >= MAX_WAITING
            && access.kind == AccessKind::Refused
            && !waiting.rows.contains_key(&access)
        {
            "several".clone_into(&mut access.address);
            "several".clone_into(&mut access.object);
            access.named.clear();
        }
        let at = now();
        let tally = waiting.rows.entry(access).or_insert(Tally { first_at: at, last_at: at, times: 0 });
        (tally.last_at, tally.times) = (at, tally.times.saturating_add(1));
        !std::mem::replace(&mut waiting.is_kept, true)
    }

    /// Takes the rows that are due: all, or those that were not written within the last minute.
    fn due(&self, all: bool) -> Vec<(Access, Tally)> {
        let mut waiting = self.waiting();
        let UnwrittenRows { rows, written, .. } = &mut *waiting;
        written.retain(|_, at| at.elapsed() < REPEAT_WINDOW);
        let mut due: Vec<_> = rows.extract_if(|access, _| all || !written.contains_key(access)).collect();
        due.sort_by_key(|(_, tally)| tally.first_at);
        written.extend(due.iter().map(|(access, _)| (access.clone(), Instant::now())));
        due
    }

    /// Puts back rows that could not be written.
    fn put_back(&self, rows: &[(Access, Tally)]) {
        let mut waiting = self.waiting();
        for (access, tally) in rows {
            waiting.written.remove(access);
            let there = waiting.rows.entry(access.clone()).or_insert(Tally { times: 0, ..*tally });
            (there.first_at, there.times) = (tally.first_at, there.times.saturating_add(tally.times));
        }
    }

    /// Writes the rows that are due, and those that commands logged next to the record.
    ///
    /// # Errors
    /// Errors of the database. No row is lost then.
    pub async fn write(&self, store: &Store, all: bool) -> Result<(), Error> {
        let mut unwritten = Unwritten { log: self, rows: self.due(all) };
        while !unwritten.rows.is_empty() {
            let count = unwritten.rows.len().min(ROWS_PER_TRANSACTION);
            append(store, &unwritten.rows[..count]).await?;
            unwritten.rows.drain(..count);
        }
        if let Some(mut spool) = access_spool::take(store.path())? {
            // If this ends early, rows are written twice rather than lost.
            while let Some(accesses) = spool.more()? {
                append(store, &accesses).await?;
            }
            spool.clear()?;
        }
        Ok(())
    }
}

/// Rows that are put back if writing them fails, panics or is cancelled.
struct Unwritten<'a> {
    log: &'a AccessLog,
    rows: Vec<(Access, Tally)>,
}

impl Drop for Unwritten<'_> {
    fn drop(&mut self) {
        self.log.put_back(&self.rows);
    }
}

async fn append(store: &Store, rows: &[(Access, Tally)]) -> StoreResult<()> {
    let mut writer = store.write().await?;
    access_log::append(&mut writer, rows).await?;
    commit(writer).await
}
