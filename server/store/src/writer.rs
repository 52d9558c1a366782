//! The only writing connection, with group commit.
//!
//! Waiting for the disk takes far longer than a change itself. Changes that are ready while the disk is busy are
//! therefore committed together: each is a savepoint within one transaction, and is acknowledged only when that
//! transaction is on the disk.

use super::anchor::{self, Anchors};
use super::free_disk_space::Space;
use super::lost_files::RecordFiles;
use super::second_writer;
use super::{StoreError, StoreResult};
use sqlx::{Connection as _, Row as _, SqliteConnection};
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::{Notify, OwnedMappedMutexGuard, OwnedMutexGuard, watch};
use tokio::task::JoinHandle;
use tokio_util::task::AbortOnDropHandle;

/// The connection, which is lent in the order of requests; `None` after closing.
type LentConnection = Arc<tokio::sync::Mutex<Option<SqliteConnection>>>;

/// A log with this number of frames is checkpointed into the database file.
const CHECKPOINT_FRAMES: u32 = 1000;

/// Pause before a restart of the flushing task.
const RESTART_PAUSE: Duration = Duration::from_millis(100);

/// The result of a group commit; `None` until it is known.
type CommitOutcome = Option<Result<(), Arc<StoreError>>>;

/// The writing connection and the task that commits its changes.
#[derive(Debug)]
pub(super) struct Writing {
    line: LentConnection,
    shared: Arc<Shared>,
    flusher: JoinHandle<()>,
}

/// An atomic change. Dropping it without [`super::commit`] rolls it back.
#[derive(Debug)]
pub struct Writer {
    connection: OwnedMappedMutexGuard<Option<SqliteConnection>, SqliteConnection>,
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    state: Mutex<WriterState>,
    /// Signals that a change has ended and must be committed.
    ended: Notify,
    space: Space,
    /// Checks and anchors outside the database.
    outside: Outside,
}

/// Checks and anchors outside the database, which take part in commits.
#[derive(Debug, Default)]
pub(super) struct Outside {
    /// The files of the record, which must not be replaced.
    pub(super) files: Option<Arc<RecordFiles>>,
    /// The anchors.
    pub(super) anchors: Option<Anchors>,
}

impl Outside {
    fn check(&self) -> StoreResult<()> {
        self.files.as_ref().map_or(Ok(()), |files| files.check())
    }

    /// [`Self::check`], and verifies the log after a commit. Returns the number of frames.
    async fn check_log(&self, connection: &mut SqliteConnection) -> StoreResult<u32> {
        let frames = log_frames(connection).await?;
        self.files.as_ref().map_or(Ok(()), |files| files.check_log(frames))?;
        Ok(frames)
    }
}

/// Changed only while the connection is held.
#[derive(Debug, Default)]
struct WriterState {
    /// The open transaction, on whose outcome its changes wait.
    group: Option<watch::Sender<CommitOutcome>>,
    /// Whether a change has begun and not ended.
    begun: bool,
    /// The data version of the connection, which changes with every commit of another connection.
    version: Option<i64>,
}

impl Writing {
    /// Takes over a connection that nothing else writes with. `version` is its data version when the record was
    /// verified.
    pub(super) fn new(connection: SqliteConnection, version: Option<i64>, space: Space, outside: Outside) -> Self {
        let line = LentConnection::new(Some(connection).into());
        let state = WriterState { version, ..WriterState::default() };
        let shared = Arc::new(Shared { state: Mutex::new(state), ended: Notify::new(), space, outside });
        let flusher = tokio::spawn(supervise_flushing(Arc::clone(&line), Arc::clone(&shared)));
        Self { line, shared, flusher }
    }

    /// The disk of the record.
    pub(super) fn space(&self) -> &Space {
        &self.shared.space
    }

    /// Begins a change after all earlier ones have ended.
    pub(super) async fn begin(&self) -> StoreResult<Writer> {
        let (line, shared) = (Arc::clone(&self.line), Arc::clone(&self.shared));
        // A separate task, because the caller may go away between two statements that belong together.
        tokio::spawn(begin(line, shared)).await.map_err(|_| StoreError::Closed)?
    }

    /// Commits all changes and closes the connection.
    pub(super) async fn close(&self) {
        let mut line = self.line.lock().await;
        if let Some(mut connection) = line.take() {
            self.shared.flush(&mut connection).await;
            if let Some(anchors) = &self.shared.outside.anchors {
                anchors.sync();
            }
            if self.shared.outside.check_log(&mut connection).await.is_err() {
                // Closing would merge a damaged log into the database file.
                std::mem::forget(connection);
                return;
            }
            if let Err(error) = connection.close().await {
                tracing::warn!(%error, "cannot close the database");
            }
        }
    }
}

impl Drop for Writing {
    fn drop(&mut self) {
        self.flusher.abort();
    }
}

impl Writer {
    /// Fails if less space is free than the reserve. To be called before starting something large.
    ///
    /// # Errors
    /// [`StoreError::NearlyFull`].
    pub fn check_free_space(&self) -> StoreResult<()> {
        self.shared.space.check_free_space()
    }

    /// Ends the change and waits until it is on the disk.
    pub(super) async fn commit(self) -> StoreResult<()> {
        let ended = tokio::spawn(async move {
            let mut writer = self;
            run(&mut writer.connection, "release change").await?;
            let mut state = writer.shared.state();
            state.begun = false;
            Ok::<_, StoreError>(state.group.as_ref().map(watch::Sender::subscribe))
        });
        let group = ended.await.map_err(|_| StoreError::Closed)??;
        let mut group = group.ok_or(StoreError::Closed)?;
        let outcome = group.wait_for(Option::is_some).await.map_err(|_| StoreError::Closed)?.clone();
        outcome.unwrap_or(Ok(())).map_err(|error| error.for_all())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.shared.ended.notify_one();
    }
}

impl Deref for Writer {
    type Target = SqliteConnection;

    fn deref(&self) -> &SqliteConnection {
        &self.connection
    }
}

impl DerefMut for Writer {
    fn deref_mut(&mut self) -> &mut SqliteConnection {
        &mut self.connection
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, WriterState> {
        // The state is consistent between statements, so a poisoned lock is usable.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Rolls back a dropped change.
    async fn retract(&self, connection: &mut SqliteConnection) {
        if !self.state().begun {
            return;
        }
        let rolled_back = match run(connection, "rollback to change").await {
            Ok(()) => run(connection, "release change").await,
            error => error,
        };
        match rolled_back {
            Ok(()) => self.state().begun = false,
            // SQLite rolled back the whole transaction, as it does when the disk is full.
            Err(error) => self.give_up(connection, &error).await,
        }
    }

    /// Commits the open transaction, and notifies all waiting changes.
    async fn flush(&self, connection: &mut SqliteConnection) {
        self.retract(connection).await;
        if self.state().group.is_none() {
            return;
        }
        match self.make_durable(connection).await {
            Ok(frames) => {
                self.tell(Ok(()));
                if frames >= CHECKPOINT_FRAMES {
                    fold(connection).await;
                }
            }
            Err(error) => self.give_up(connection, &error).await,
        }
    }

    /// Returns the number of frames of the log.
    async fn make_durable(&self, connection: &mut SqliteConnection) -> StoreResult<u32> {
        let anchored = match &self.outside.anchors {
            Some(anchors) => Some((anchors, anchor::ends(connection).await?)),
            None => None,
        };
        // Check before the commit, which would restore the length of a truncated log and hide the loss.
        self.outside.check()?;
        run(connection, "commit").await?;
        // A change that was written to a deleted file or a truncated log must not be acknowledged.
        let frames = self.outside.check_log(connection).await?;
        if let Some((anchors, ends)) = anchored {
            anchors.write(&ends);
        }
        Ok(frames)
    }

    async fn give_up(&self, connection: &mut SqliteConnection, error: &StoreError) {
        // Fails if SQLite has already rolled back.
        let _ = run(connection, "rollback").await;
        self.save(connection, error).await;
        self.tell(Err(Arc::new(error.for_all())));
    }

    /// Saves the content of a deleted log to the database file, because it would be lost with the process.
    async fn save(&self, connection: &mut SqliteConnection, error: &StoreError) {
        let vanished = matches!(error, StoreError::RecordVanished { .. });
        let Ok(frames) = log_frames(connection).await else { return };
        if vanished && self.outside.files.as_ref().is_some_and(|files| files.log_is_to_be_saved(frames)) {
            fold(connection).await;
            tracing::warn!("the write-ahead log was checkpointed");
        }
    }

    fn tell(&self, outcome: Result<(), Arc<StoreError>>) {
        let mut state = self.state();
        state.begun = false;
        if let Some(group) = state.group.take() {
            group.send_replace(Some(outcome));
        }
    }
}

async fn begin(line: LentConnection, shared: Arc<Shared>) -> StoreResult<Writer> {
    let held = line.lock_owned().await;
    let mut connection = OwnedMutexGuard::try_map(held, Option::as_mut).map_err(|_| StoreError::Closed)?;
    shared.retract(&mut connection).await;
    if shared.state().group.is_none() {
        if let Err(error) = shared.outside.check() {
            shared.save(&mut connection, &error).await;
            return Err(error);
        }
        run(&mut connection, "begin immediate").await?;
        let seen = shared.state().version;
        match second_writer::refuse(&mut connection, shared.outside.files.as_deref(), seen).await {
            Ok(version) => shared.state().version = Some(version),
            Err(error) => {
                let _ = run(&mut connection, "rollback").await;
                return Err(error);
            }
        }
        shared.state().group = Some(watch::channel(None).0);
    }
    if let Err(error) = run(&mut connection, "savepoint change").await {
        shared.give_up(&mut connection, &error).await;
        return Err(error);
    }
    shared.state().begun = true;
    Ok(Writer { connection, shared })
}

/// Restarts [`keep_flushing`] after a panic, because every change waits for it.
async fn supervise_flushing(line: LentConnection, shared: Arc<Shared>) {
    loop {
        let flushing = keep_flushing(Arc::clone(&line), Arc::clone(&shared));
        match AbortOnDropHandle::new(tokio::spawn(flushing)).await {
            Ok(()) => return,
            Err(error) => tracing::error!(%error, "the commit task panicked; restarting it"),
        }
        shared.ended.notify_one();
        tokio::time::sleep(RESTART_PAUSE).await;
    }
}

/// Commits changes as they end. Changes that are already waiting join the same transaction.
async fn keep_flushing(line: LentConnection, shared: Arc<Shared>) {
    loop {
        shared.ended.notified().await;
        match line.lock().await.as_mut() {
            Some(connection) => shared.flush(connection).await,
            None => return,
        }
    }
}

/// Number of frames in the write-ahead log.
async fn log_frames(connection: &mut SqliteConnection) -> StoreResult<u32> {
    let row = sqlx::query("pragma wal_checkpoint(noop)").fetch_one(connection).await?;
    Ok(row.try_get("log")?)
}

/// Merges the log into the database file.
async fn fold(connection: &mut SqliteConnection) {
    if let Err(error) = run(connection, "pragma wal_checkpoint(passive)").await {
        tracing::error!(%error, "cannot checkpoint the write-ahead log");
    }
}

async fn run(connection: &mut SqliteConnection, statement: &'static str) -> StoreResult<()> {
    sqlx::query(statement).execute(connection).await?;
    Ok(())
}

#[cfg(test)]
mod tests;
