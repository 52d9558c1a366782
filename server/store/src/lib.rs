//! The record: one SQLite file, owned by one process.
//!
//! Only this crate depends on SQLite. Reads go through a small pool of read-only connections that never block;
//! writes go through one connection, one after the other, so that no writer ever meets `SQLITE_BUSY`.
//! A transaction never spans CPU or network work.

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod access_log;
pub mod access_spool;
pub mod allocations;
pub mod anchor;
pub mod archive;
pub mod archived_allocations;
pub mod audit;
pub mod backup;
pub mod certificates;
pub mod clock;
pub mod consents;
pub mod devices;
mod error;
pub mod events;
pub mod explanations;
pub mod feedback;
mod file_kind;
mod files;
pub mod gaits;
mod id;
pub mod idempotency;
pub mod imports;
pub mod jobs;
mod json;
pub mod lab_answers;
pub mod lab_recordings;
pub mod lab_sessions;
mod lent;
pub mod listing;
mod log;
mod many_rows;
pub mod members;
mod migrations;
mod ownership;
mod packed;
pub mod presentations;
pub mod quarantine;
pub mod reach;
pub mod reference_gaits;
pub mod remarks;
pub mod restore;
pub mod results;
pub mod rights;
pub mod row;
pub mod safety_reviews;
pub mod schema;
pub mod seals;
pub mod sessions;
pub mod sign_in_failures;
mod space;
pub mod studies;
pub mod subjects;
mod time;
pub mod tokens;
pub mod totals;
pub mod trials;
pub mod users;
pub mod verify;
pub mod whole_file;
mod writing;

pub use error::{OnConstraint, StoreError, StoreResult};
pub use id::{
    DeviceId, EmgResultId, FeedbackId, JobId, LabDeviceFileId, LabRecordingId, LabSessionId, MemberId, PresentationId,
    ReferenceGaitId, RemarkId, SafetyReviewId, SessionId, StudyId, SubjectId, TokenId, TrialId, UserId,
};
pub use lent::{Lent, LentWriter, Reader};
pub use migrations::FORM;
pub use packed::{Packed, PackedText};
pub use space::DEFAULT_RESERVE_BYTES;
pub use time::{Instant, now};
pub use writing::Writer;

use anchor::Anchors;
use files::Files;
use gaitwright_compute::{ComputeError, OnPool, Pool};
use ownership::Ownership;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};
use sqlx::{SqliteConnection, SqlitePool};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Mutex;
use writing::{Outside, Writing};

/// Whether the record takes changes is tried at most so often.
const PROBED_AGAIN: Duration = Duration::from_secs(1);
/// When it was tried whether the record takes changes, and why not.
type Probe = (std::time::Instant, Result<(), String>);

/// A change that takes longer is as good as none.
const SLOWEST_PROBE: Duration = Duration::from_secs(5);

/// The open record. It lends connections and computing, never both at once.
///
/// ```compile_fail,E0502
/// # use gaitwright_store::{Store, StoreResult};
/// async fn computes_inside_a_connection(mut store: Store) -> StoreResult<()> {
///     let _reader = store.read().await?;
///     let _ = store.compute(|_| 1 + 1).await;
///     Ok(())
/// }
/// ```
///
/// ```compile_fail,E0502
/// # use gaitwright_store::{Store, StoreResult};
/// async fn computes_inside_a_transaction(mut store: Store) -> StoreResult<()> {
///     let writer = store.write().await?;
///     let _ = store.compute(|_| 1 + 1).await;
///     gaitwright_store::commit(writer).await
/// }
/// ```
#[derive(Debug, Clone)]
pub struct Store {
    /// Read-only connections.
    readers: SqlitePool,
    /// The one connection that writes.
    writing: Arc<Writing>,
    /// Where the file is, for messages.
    path: PathBuf,
    /// Held while a copy is made beside the record: two that begin together take two names.
    copying: Arc<Mutex<()>>,
    /// What is computed from what was read.
    pool: Pool,
    /// When it was last tried whether the record takes changes, and what was found.
    probed: Arc<Mutex<Option<Probe>>>,
    /// Held until the record is closed or the last clone is dropped: a second process that opens the file for writing is
    /// refused.
    owner: Arc<Mutex<Option<Ownership>>>,
}

impl Store {
    /// Opens or creates the file, takes ownership of it and brings its schema up to date.
    ///
    /// # Errors
    /// As [`Store::open_anchored`].
    pub async fn open(path: &Path) -> StoreResult<Self> {
        Self::open_anchored(path, None).await
    }

    /// [`Store::open`] with a second anchor, best on another disk than the record and the anchor beside it.
    ///
    /// # Errors
    /// [`StoreError::NotADatabase`] when the file is something else, [`StoreError::InUse`] when another process owns
    /// it, [`StoreError::NewerSchema`] when a newer version of the program wrote it, [`StoreError::RecordMissing`],
    /// [`StoreError::CutOff`] and [`StoreError::Rewritten`] when an anchor has seen more than there is,
    /// [`StoreError::Unsealed`] when another program wrote a row, otherwise what the database reports.
    pub async fn open_anchored(path: &Path, elsewhere: Option<&Path>) -> StoreResult<Self> {
        file_kind::check(path)?;
        let anchors: Vec<PathBuf> =
            [Some(anchor::beside_record(path)), elsewhere.map(Path::to_owned)].into_iter().flatten().collect();
        let mut owner = Ownership::take(path)?;
        let checked = async {
            refuse_unchanged(path).await?;
            refuse_empty_in_place_of_record(path, &anchors)?;
            owner.make_database(path)
        };
        if let Err(error) = checked.await {
            let error = file_kind::named(path, error);
            if error.is_wrong_file() {
                owner.withdraw();
            }
            return Err(error);
        }
        let opened = Self::open_owned(path, anchors).await.map_err(|error| file_kind::named(path, error));
        match &opened {
            Ok(store) => *store.owner.lock().await = Some(owner),
            Err(error) if error.is_wrong_file() => owner.withdraw(),
            Err(_) => {}
        }
        opened
    }

    /// Opens a file that this process owns.
    async fn open_owned(path: &Path, anchors: Vec<PathBuf>) -> StoreResult<Self> {
        let options = SqliteConnectOptions::new()
            .filename(path)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            .foreign_keys(true)
            .busy_timeout(Duration::from_secs(10))
            // Every table has statements of its own for its seals.
            .statement_cache_capacity(400);
        let only = SqlitePoolOptions::new().max_connections(1).connect_with(options.clone()).await?;
        if migrations::check_version(&only, path).await? == 0 {
            refuse_to_begin_anew(path, &anchors)?;
        } else {
            for anchor in &anchors {
                anchor::check(&mut *only.acquire().await?, path, anchor).await?;
            }
        }
        migrations::apply(&only, path).await?;
        let mut connection = only.acquire().await?.detach();
        seals::watch(&mut connection).await?;
        // The log goes into the file when it was read back, and not in the middle of a commit.
        sqlx::query("pragma wal_autocheckpoint = 0").execute(&mut connection).await?;
        let files = Arc::new(Files::of(path)?);
        let outside = Outside { files: Some(Arc::clone(&files)), anchors: Some(Anchors::at(anchors)) };
        let writing = Arc::new(Writing::new(connection, space::Space::of(path), outside));
        let readers = SqlitePoolOptions::new()
            .max_connections(4)
            .idle_timeout(None)
            .max_lifetime(None)
            // Never what lies there in place of the record.
            .after_connect(move |_, _| {
                let files = files.check().map_err(|error| sqlx::Error::Configuration(error.into()));
                Box::pin(async move { files })
            })
            .connect_with(options.read_only(true))
            .await?;
        let store = Self {
            readers,
            writing,
            path: path.to_owned(),
            copying: Arc::default(),
            pool: Pool::default(),
            probed: Arc::default(),
            owner: Arc::default(),
        };
        commit(store.write().await?).await?;
        Ok(store)
    }

    /// A connection to read with.
    ///
    /// # Errors
    /// When no connection can be had.
    pub async fn read(&self) -> StoreResult<Reader<'_>> {
        Ok(Lent::new(self.readers.acquire().await?))
    }

    /// Computes on a pool: what takes long, off the threads that answer. Whoever calls this holds no connection of this
    /// handle, and what is computed with is owned.
    ///
    /// # Errors
    /// When the work panics.
    pub async fn compute<T: Send + 'static>(
        &mut self,
        work: impl FnOnce(&OnPool) -> T + Send + 'static,
    ) -> Result<T, ComputeError> {
        self.pool.run(work).await
    }

    /// The same record with a pool of its own, so that what others compute does not hold up its computing.
    #[must_use]
    pub fn with_own_pool(&self) -> Self {
        Self { pool: Pool::default(), ..self.clone() }
    }

    /// Begins a write transaction; dropped without [`commit`], it leaves no trace.
    ///
    /// # Errors
    /// When no transaction can be begun.
    pub async fn write(&self) -> StoreResult<LentWriter<'_>> {
        Ok(Lent::new(self.writing.begin().await?))
    }

    /// Keeps so many free bytes in reserve: below, nothing large is begun.
    pub fn set_reserve(&self, bytes: u64) {
        self.writing.space().set_reserve(bytes);
    }

    /// Refuses where less is free than is kept in reserve.
    ///
    /// # Errors
    /// [`StoreError::NearlyFull`].
    pub fn room(&self) -> StoreResult<()> {
        self.writing.space().room()
    }

    /// Writes durably, and changes nothing: whether the record takes changes. Asked often, it answers what it found within
    /// the last second.
    ///
    /// # Errors
    /// Why it takes none.
    pub async fn probe(&self) -> Result<(), String> {
        let mut last = self.probed.lock().await;
        if let Some((at, found)) = &*last
            && at.elapsed() < PROBED_AGAIN
        {
            return found.clone();
        }
        let found = match tokio::time::timeout(SLOWEST_PROBE, self.write_nothing()).await {
            Ok(written) => written.map_err(|error| error.to_string()),
            Err(_) => Err(format!("no change was possible within {} s", SLOWEST_PROBE.as_secs())),
        };
        *last = Some((std::time::Instant::now(), found.clone()));
        found
    }

    /// Writes a header field of the file as it is.
    async fn write_nothing(&self) -> StoreResult<()> {
        let mut writer = self.write().await?;
        let row = sqlx::query("pragma user_version").fetch_one(&mut **writer).await?;
        let version: i64 = sqlx::Row::try_get(&row, 0)?;
        sqlx::query(sqlx::AssertSqlSafe(format!("pragma user_version = {version}"))).execute(&mut **writer).await?;
        commit(writer).await
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Closes every connection, folding the write-ahead log into the file, and gives up the ownership of it.
    pub async fn close(&self) {
        self.readers.close().await;
        self.writing.close().await;
        drop(self.owner.lock().await.take());
    }
}

/// Makes the changes of a transaction durable.
///
/// # Errors
/// When the database cannot; nothing has happened then.
pub async fn commit(mut writer: LentWriter<'_>) -> StoreResult<()> {
    seals::seal(&mut writer).await?;
    writer.into_writer().commit().await
}

/// SHA-256, hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    json::sha256(bytes)
}

/// A plain connection: what the functions of the nouns take, from a [`Reader`] or a [`Writer`].
pub type Connection = SqliteConnection;

/// Refuses the file of another program, or of a newer version of this one, before a connection that may write touches it.
async fn refuse_unchanged(path: &Path) -> StoreResult<()> {
    if !std::fs::metadata(path).is_ok_and(|file| file.len() > 0) {
        return Ok(());
    }
    let options = SqliteConnectOptions::new().filename(path).read_only(true);
    let Ok(pool) = SqlitePoolOptions::new().max_connections(1).connect_with(options).await else { return Ok(()) };
    let checked = migrations::check_version(&pool, path).await;
    pool.close().await;
    match checked {
        Err(refusal @ (StoreError::NotADatabase { .. } | StoreError::NewerSchema { .. })) => Err(refusal),
        // What cannot be read without writing, such as a journal to be rolled back, is seen by the next connection.
        _ => Ok(()),
    }
}

/// An empty file is a record to be made, unless there was one.
fn refuse_empty_in_place_of_record(path: &Path, anchors: &[PathBuf]) -> StoreResult<()> {
    let bytes = |file: &Path| std::fs::metadata(file).map_or(0, |file| file.len());
    if bytes(path) > 0 {
        return Ok(());
    }
    let log = beside(path, "-wal");
    if bytes(&log) > 0 {
        return Err(StoreError::RecordMissing { path: path.to_owned(), evidence: log });
    }
    refuse_to_begin_anew(path, anchors)
}

/// A file without a schema is all that is left of a record whose log was lost.
fn refuse_to_begin_anew(path: &Path, anchors: &[PathBuf]) -> StoreResult<()> {
    for anchor in anchors {
        if anchor::has_seen_rows(anchor)? {
            return Err(StoreError::RecordMissing { path: path.to_owned(), evidence: anchor.clone() });
        }
    }
    Ok(())
}

/// The file next to the record whose name ends so.
fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// `gaitwright.db.WHAT-20260501T101500`, or with a number where there is one of that second.
fn free_name(of: &Path, what: &str) -> PathBuf {
    let stamp: String = now().to_string().chars().filter(char::is_ascii_alphanumeric).take(15).collect();
    let first = beside(of, &format!(".{what}-{stamp}"));
    let mut name = first.clone();
    let mut number = 1_u32;
    while name.exists() {
        number += 1;
        name = beside(&first, &format!("-{number}"));
    }
    name
}
