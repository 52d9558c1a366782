//! The one connection that writes.
//!
//! Making a change durable means waiting for the disk, which takes far longer than the change itself. Changes that
//! are ready while the disk is busy are therefore made durable together: each is a savepoint of its own within one
//! transaction, and each is acknowledged only when that transaction is on the disk.

use super::anchor::{self, Anchors};
use super::files::Files;
use super::space::Space;
use super::{StoreError, StoreResult};
use sqlx::{Connection as _, Row as _, SqliteConnection};
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::{Notify, OwnedMappedMutexGuard, OwnedMutexGuard, watch};
use tokio::task::JoinHandle;
use tokio_util::task::AbortOnDropHandle;

/// The connection; `None`: closed. Whoever waits for it gets it in the order of asking.
type Line = Arc<tokio::sync::Mutex<Option<SqliteConnection>>>;

/// A log with so many frames goes into the database file.
const LONGEST_LOG: u32 = 1000;

/// Pause before the making durable is begun again.
const PAUSE: Duration = Duration::from_millis(100);

/// How the disk answered for a group of changes; `None`: not yet.
type Outcome = Option<Result<(), Arc<StoreError>>>;

/// The writing connection, and what makes its changes durable.
#[derive(Debug)]
pub(super) struct Writing {
    line: Line,
    shared: Arc<Shared>,
    flusher: JoinHandle<()>,
}

/// A change: everything in it happens, or nothing. Dropped without [`super::commit`], it leaves no trace.
#[derive(Debug)]
pub struct Writer {
    connection: OwnedMappedMutexGuard<Option<SqliteConnection>, SqliteConnection>,
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    /// A change ended: what is there is to be made durable.
    ended: Notify,
    space: Space,
    /// What is outside the database.
    outside: Outside,
}

/// What is outside the database and has a say in its changes; none of it: nobody asks.
#[derive(Debug, Default)]
pub(super) struct Outside {
    /// The files, which must be those that were opened.
    pub(super) files: Option<Arc<Files>>,
    /// What holds the newest hashes.
    pub(super) anchors: Option<Anchors>,
}

impl Outside {
    fn check(&self) -> StoreResult<()> {
        self.files.as_ref().map_or(Ok(()), |files| files.check())
    }

    /// [`Self::check`], and reads back what the commit wrote: how many frames the log has.
    async fn check_log(&self, connection: &mut SqliteConnection) -> StoreResult<u32> {
        let frames = log_frames(connection).await?;
        self.files.as_ref().map_or(Ok(()), |files| files.check_log(frames))?;
        Ok(frames)
    }
}

/// Changes only while the connection is held.
#[derive(Debug, Default)]
struct State {
    /// A transaction is open; whoever has a change in it waits for its outcome.
    group: Option<watch::Sender<Outcome>>,
    /// A change was begun and did not end yet.
    begun: bool,
}

impl Writing {
    /// Over a connection that nobody else writes with.
    pub(super) fn new(connection: SqliteConnection, space: Space, outside: Outside) -> Self {
        let line = Line::new(Some(connection).into());
        let shared = Arc::new(Shared { state: Mutex::default(), ended: Notify::new(), space, outside });
        let flusher = tokio::spawn(supervise_flushing(Arc::clone(&line), Arc::clone(&shared)));
        Self { line, shared, flusher }
    }

    /// The disk of the record.
    pub(super) fn space(&self) -> &Space {
        &self.shared.space
    }

    /// Begins a change when those before it have ended.
    pub(super) async fn begin(&self) -> StoreResult<Writer> {
        let (line, shared) = (Arc::clone(&self.line), Arc::clone(&self.shared));
        // A task of its own: whoever asked may go away between two statements, which belong together.
        tokio::spawn(begin(line, shared)).await.map_err(|_| StoreError::Closed)?
    }

    /// Makes durable what is there, and closes the connection.
    pub(super) async fn close(&self) {
        let mut line = self.line.lock().await;
        if let Some(mut connection) = line.take() {
            self.shared.flush(&mut connection).await;
            if let Some(anchors) = &self.shared.outside.anchors {
                anchors.sync();
            }
            if self.shared.outside.check_log(&mut connection).await.is_err() {
                // Closing would write a log with a hole in it into the database file.
                std::mem::forget(connection);
                return;
            }
            if let Err(error) = connection.close().await {
                tracing::warn!(%error, "closing the database");
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
    /// Refuses where less space is free than is kept in reserve: whoever begins something large asks.
    ///
    /// # Errors
    /// [`StoreError::NearlyFull`].
    pub fn room(&self) -> StoreResult<()> {
        self.shared.space.room()
    }

    /// Ends the change and waits until the disk has it.
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
    fn state(&self) -> MutexGuard<'_, State> {
        // The state is whole between any two statements that hold the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes back a change that was begun and dropped.
    async fn take_back(&self, connection: &mut SqliteConnection) {
        if !self.state().begun {
            return;
        }
        let taken_back = match run(connection, "rollback to change").await {
            Ok(()) => run(connection, "release change").await,
            error => error,
        };
        match taken_back {
            Ok(()) => self.state().begun = false,
            // The database gave up the whole transaction, as it does when the disk is full.
            Err(error) => self.give_up(connection, &error).await,
        }
    }

    /// Makes the open transaction durable and tells everybody who waits for it.
    async fn flush(&self, connection: &mut SqliteConnection) {
        self.take_back(connection).await;
        if self.state().group.is_none() {
            return;
        }
        match self.make_durable(connection).await {
            Ok(frames) => {
                self.tell(Ok(()));
                if frames >= LONGEST_LOG {
                    fold(connection).await;
                }
            }
            Err(error) => self.give_up(connection, &error).await,
        }
    }

    /// How many frames the log has afterwards.
    async fn make_durable(&self, connection: &mut SqliteConnection) -> StoreResult<u32> {
        let anchored = match &self.outside.anchors {
            Some(anchors) => Some((anchors, anchor::ends(connection).await?)),
            None => None,
        };
        // The commit makes a log that was cut as long as before, with a hole in it: its length tells nothing afterwards.
        self.outside.check()?;
        run(connection, "commit").await?;
        // A change that went into a deleted file, or into a log that was cut meanwhile, must not be acknowledged.
        let frames = self.outside.check_log(connection).await?;
        if let Some((anchors, ends)) = anchored {
            anchors.write(&ends);
        }
        Ok(frames)
    }

    async fn give_up(&self, connection: &mut SqliteConnection, error: &StoreError) {
        // Fails when the database did so already.
        let _ = run(connection, "rollback").await;
        self.save(connection, error).await;
        self.tell(Err(Arc::new(error.for_all())));
    }

    /// A log that has no name any more is lost with the process. As long as the database file is there, what is in the log
    /// can go where it belongs.
    async fn save(&self, connection: &mut SqliteConnection, error: &StoreError) {
        let vanished = matches!(error, StoreError::RecordVanished { .. });
        let Ok(frames) = log_frames(connection).await else { return };
        if vanished && self.outside.files.as_ref().is_some_and(|files| files.log_is_to_be_saved(frames)) {
            fold(connection).await;
            tracing::warn!("what was in the write-ahead log was written into the database file");
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

async fn begin(line: Line, shared: Arc<Shared>) -> StoreResult<Writer> {
    let held = line.lock_owned().await;
    let mut connection = OwnedMutexGuard::try_map(held, Option::as_mut).map_err(|_| StoreError::Closed)?;
    shared.take_back(&mut connection).await;
    if shared.state().group.is_none() {
        if let Err(error) = shared.outside.check() {
            shared.save(&mut connection, &error).await;
            return Err(error);
        }
        run(&mut connection, "begin immediate").await?;
        shared.state().group = Some(watch::channel(None).0);
    }
    if let Err(error) = run(&mut connection, "savepoint change").await {
        shared.give_up(&mut connection, &error).await;
        return Err(error);
    }
    shared.state().begun = true;
    Ok(Writer { connection, shared })
}

/// Begins [`keep_flushing`] again where it panicked: every change waits for it.
async fn supervise_flushing(line: Line, shared: Arc<Shared>) {
    loop {
        let flushing = keep_flushing(Arc::clone(&line), Arc::clone(&shared));
        match AbortOnDropHandle::new(tokio::spawn(flushing)).await {
            Ok(()) => return,
            Err(error) => tracing::error!(%error, "making changes durable failed; it is begun again"),
        }
        shared.ended.notify_one();
        tokio::time::sleep(PAUSE).await;
    }
}

/// Makes changes durable as they end: those that stand in line by then come first, and into the same transaction.
async fn keep_flushing(line: Line, shared: Arc<Shared>) {
    loop {
        shared.ended.notified().await;
        match line.lock().await.as_mut() {
            Some(connection) => shared.flush(connection).await,
            None => return,
        }
    }
}

/// Frames in the write-ahead log.
async fn log_frames(connection: &mut SqliteConnection) -> StoreResult<u32> {
    let row = sqlx::query("pragma wal_checkpoint(noop)").fetch_one(connection).await?;
    Ok(row.try_get("log")?)
}

/// Writes the log into the database file.
async fn fold(connection: &mut SqliteConnection) {
    if let Err(error) = run(connection, "pragma wal_checkpoint(passive)").await {
        tracing::error!(%error, "the write-ahead log cannot be written into the database file");
    }
}

async fn run(connection: &mut SqliteConnection, statement: &'static str) -> StoreResult<()> {
    sqlx::query(statement).execute(connection).await?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sqlx::sqlite::SqliteConnectOptions;

    async fn open(file: &std::path::Path) -> SqliteConnection {
        let options = SqliteConnectOptions::new().filename(file).create_if_missing(true);
        SqliteConnection::connect_with(&options.journal_mode(sqlx::sqlite::SqliteJournalMode::Wal)).await.unwrap()
    }

    async fn table(file: &std::path::Path) -> Writing {
        let mut connection = open(file).await;
        run(&mut connection, "create table t (x integer primary key) strict").await.unwrap();
        Writing::new(connection, Space::of(file), Outside::default())
    }

    async fn insert(writer: &mut Writer, x: i64) -> Result<(), sqlx::Error> {
        sqlx::query("insert into t (x) values (?)").bind(x).execute(&mut **writer).await.map(drop)
    }

    /// What another connection sees: what is durable.
    async fn rows(file: &std::path::Path) -> Vec<i64> {
        let rows = sqlx::query("select x from t order by x").fetch_all(&mut open(file).await).await.unwrap();
        rows.iter().map(|row| row.get(0)).collect()
    }

    #[tokio::test]
    async fn a_change_is_there_for_others_when_it_is_acknowledged_and_a_dropped_one_never() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.db");
        let writing = table(&file).await;
        let mut kept = writing.begin().await.unwrap();
        insert(&mut kept, 1).await.unwrap();
        kept.commit().await.unwrap();
        assert_eq!(rows(&file).await, [1]);
        let mut dropped = writing.begin().await.unwrap();
        insert(&mut dropped, 2).await.unwrap();
        assert!(insert(&mut dropped, 1).await.is_err());
        drop(dropped);
        let mut after = writing.begin().await.unwrap();
        insert(&mut after, 3).await.unwrap();
        after.commit().await.unwrap();
        assert_eq!(rows(&file).await, [1, 3]);
        writing.close().await;
        assert!(matches!(writing.begin().await, Err(StoreError::Closed)));
    }

    #[tokio::test]
    async fn many_at_once_all_happen_and_those_that_fail_take_nothing_with_them() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.db");
        let writing = Arc::new(table(&file).await);
        let changes = (0..200_i64).map(|x| {
            let writing = Arc::clone(&writing);
            tokio::spawn(async move {
                let mut writer = writing.begin().await.unwrap();
                insert(&mut writer, x).await.unwrap();
                if x % 3 == 0 { drop(writer) } else { writer.commit().await.unwrap() }
            })
        });
        for change in changes.collect::<Vec<_>>() {
            change.await.unwrap();
        }
        writing.close().await;
        assert_eq!(rows(&file).await, (0..200).filter(|x| x % 3 != 0).collect::<Vec<_>>());
    }

    #[tokio::test]
    async fn whoever_shares_a_transaction_that_the_database_gives_up_is_told_so() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.db");
        let writing = table(&file).await;
        let mut first = writing.begin().await.unwrap();
        insert(&mut first, 1).await.unwrap();
        // As when the disk is full: the whole transaction is gone.
        run(&mut first, "rollback").await.unwrap();
        assert!(first.commit().await.is_err());
        let mut second = writing.begin().await.unwrap();
        insert(&mut second, 2).await.unwrap();
        second.commit().await.unwrap();
        assert_eq!(rows(&file).await, [2]);
        writing.close().await;
    }
}
