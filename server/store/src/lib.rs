//! The record: one SQLite database, owned by one process. Only this crate contains SQL and depends on SQLite.
//!
//! Reads go through a small pool of read-only connections that never block;
//! writes go through one connection, one after the other, so that no writer ever meets `SQLITE_BUSY`.
//! A transaction never spans CPU or network work.

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod access_clock;
pub mod access_log;
pub mod access_spool;
pub mod accessible_studies;
pub mod allocations;
pub mod anchor;
pub mod archived_allocations;
pub mod archived_row;
pub mod archived_rows;
pub mod assessments;
pub mod atomic_file;
pub mod attempts;
pub mod audit;
pub mod authors;
pub mod backup;
pub mod backup_folder;
pub mod blind_pairs;
mod borrowed_connection;
pub mod cancelled_jobs;
pub mod certificates;
mod compressed_columns;
mod connection;
pub mod consents;
pub mod devices;
mod error;
pub mod events;
pub mod execution_reports;
pub mod explanations;
pub mod feedback;
mod free_disk_space;
pub mod gaits;
mod id;
pub mod idempotency;
pub mod imports;

mod interrupted_restore;
mod json_columns;
pub mod lab_answers;
pub mod lab_sessions;
mod lost_files;
mod many_rows;
pub mod measurement_files;
pub mod members;
mod migrations;
mod opening_checks;
pub mod other_local_optima;
pub mod quarantine;
pub mod read_only;
mod record_file_names;
mod record_lock;
pub mod reference_gaits;
pub mod restore;
pub mod rights;
pub mod safety_reports;
pub mod safety_reviews;
mod schema_versions;
pub mod seals;
mod second_writer;
pub mod sessions;
pub mod sign_in_failures;
pub mod solve_inputs;
pub mod solve_jobs;
mod sqlite_file;
pub mod studies;
pub mod subjects;
mod time;
pub mod tokens;
pub mod totals;
pub mod trial_list;
pub mod trials;
pub mod users;
mod verified_copy;
pub mod verify;
mod wal_check;
mod writer;

pub use borrowed_connection::{Borrowed, BorrowedWriter, Reader};
pub use compressed_columns::{Packed, PackedText};
pub use connection::Connection;
pub use error::{OnConstraint, StoreError, StoreResult};
pub use free_disk_space::{DEFAULT_RESERVE_BYTES, free_bytes};
pub use id::{
    AnswerId, AssessmentId, BackupId, BlindPairId, ControllerFileDownloadId, DeviceId, EmgResultId, FeedbackId,
    LabSessionId, MeasurementFileId, MemberId, ReferenceGaitId, SafetyReportId, SafetyReviewId, SessionId, SolveJobId,
    StudyId, SubjectId, TokenId, TrialId, UserId,
};
pub use opening_checks::check_path;
pub use record_lock::is_open_elsewhere;
pub use schema_versions::SCHEMA_VERSION;
pub use time::{Instant, now, set_machine_clock};
pub use writer::Writer;

use anchor::Anchors;
use gaitwright_compute::{ComputeError, OnPool, Pool};
use lost_files::RecordFiles;
use opening_checks::{check_history, refuse_empty_in_place_of_record, refuse_unchanged, verify_and_migrate};
use record_lock::RecordLock;
use sqlx::ConnectOptions as _;
use sqlx::SqlitePool;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Mutex;
use writer::{Outside, Writing};

/// Least time between two probes.
const PROBE_INTERVAL: Duration = Duration::from_secs(1);
/// When it was last tried whether the record can be written, and the result.
type Probe = (std::time::Instant, Result<(), String>);

/// Time limit of a probe.
const PROBE_TIMEOUT: Duration = Duration::from_secs(5);

/// The open record. It lends either connections or the thread pool, never both at once.
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
    /// The only writing connection.
    writing: Arc<Writing>,
    /// Path of the file.
    path: PathBuf,
    /// Held during a backup, so that two backups at once get different names.
    copying: Arc<Mutex<()>>,
    /// Threads for computations.
    pool: Pool,
    /// The last probe.
    probed: Arc<Mutex<Option<Probe>>>,
    /// Held until the record is closed or the last clone is dropped, so that no other process can open the file for
    /// writing.
    record_lock: Arc<Mutex<Option<RecordLock>>>,
}

impl Store {
    /// Opens or creates the file, takes ownership of it and migrates its schema.
    ///
    /// # Errors
    /// As [`Store::open_anchored`].
    pub async fn open(path: &Path) -> StoreResult<Self> {
        Self::open_anchored(path, None).await
    }

    /// [`Store::open`] with a second anchor, best on another disk.
    ///
    /// # Errors
    /// [`StoreError::NoFileName`], [`StoreError::NotADatabase`], [`StoreError::SeveralNames`], [`StoreError::Open`] if a file of
    /// the record cannot be written, [`StoreError::InUse`] if another process owns the file,
    /// [`StoreError::NewerSchema`], [`StoreError::DevelopmentSchema`], [`StoreError::WrongAnchor`],
    /// [`StoreError::RecordMissing`], [`StoreError::CutOff`] and [`StoreError::Rewritten`]
    /// if the record contradicts an anchor, [`StoreError::Unsealed`] and [`StoreError::Damaged`] if another program
    /// added, changed or deleted a row or changed the schema; errors of the database.
    pub async fn open_anchored(path: &Path, elsewhere: Option<&Path>) -> StoreResult<Self> {
        anchor::refuse_wrong(elsewhere, path, None)?;
        sqlite_file::check(path)?;
        let anchors = opening_checks::anchors(path, elsewhere);
        let mut record_lock = RecordLock::take(path)?;
        let checked = async {
            interrupted_restore::finish_interrupted(path)?;
            opening_checks::refuse_unwritable_companions(path)?;
            refuse_unchanged(path).await?;
            refuse_empty_in_place_of_record(path, &anchors)?;
            record_lock.make_database(path)
        };
        if let Err(error) = checked.await {
            let error = sqlite_file::named(path, error);
            if error.is_wrong_file() {
                record_lock.withdraw();
            }
            return Err(error);
        }
        let opened = Self::open_owned(path, anchors).await.map_err(|error| sqlite_file::named(path, error));
        match &opened {
            Ok(store) => *store.record_lock.lock().await = Some(record_lock),
            Err(error) if error.is_wrong_file() => record_lock.withdraw(),
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
            // Each table has its own statements for seals.
            .statement_cache_capacity(400)
            // On a slow disk, the whole schema would be logged as a slow statement.
            .log_slow_statements(log::LevelFilter::Debug, Duration::from_secs(1));
        // Few rows ahead, because the verification reads rows that contain whole measurement files.
        let one = options.clone().row_buffer_size(quarantine::ROWS_AHEAD);
        let only = SqlitePoolOptions::new().max_connections(1).connect_with(one).await?;
        if let Err(refused) = check_history(&only, path, &anchors).await {
            // A log that is left behind would be taken for that of a lost record.
            only.close().await;
            return Err(refused);
        }
        let version = second_writer::data_version(&mut *only.acquire().await?).await?;
        verify_and_migrate(&only, path, schema_versions::FILES).await?;
        if let Some(newest) = audit::newest(&mut *only.acquire().await?).await? {
            time::never_before(newest);
        }
        let mut connection = only.acquire().await?.detach();
        seals::watch(&mut connection).await?;
        // The log is merged into the file only after it was verified, not in the middle of a commit.
        sqlx::query("pragma wal_autocheckpoint = 0").execute(&mut connection).await?;
        let files = Arc::new(RecordFiles::of(path)?);
        let outside = Outside { files: Some(Arc::clone(&files)), anchors: Some(Anchors::at(anchors)) };
        let writing = Arc::new(Writing::new(connection, Some(version), free_disk_space::Space::of(path), outside));
        let readers = SqlitePoolOptions::new()
            .max_connections(4)
            .idle_timeout(None)
            .max_lifetime(None)
            // Refuse to open a file that has replaced the record.
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
            record_lock: Arc::default(),
        };
        commit(store.write().await?).await?;
        Ok(store)
    }

    /// A read-only connection.
    ///
    /// # Errors
    /// If no connection is available.
    pub async fn read(&self) -> StoreResult<Reader<'_>> {
        Ok(Borrowed::new(self.readers.acquire().await?))
    }

    /// Runs a long computation on the thread pool. The exclusive borrow ensures that the caller holds no connection of
    /// this handle.
    ///
    /// # Errors
    /// If the work panics.
    pub async fn compute<T: Send + 'static>(
        &mut self,
        work: impl FnOnce(&OnPool) -> T + Send + 'static,
    ) -> Result<T, ComputeError> {
        self.pool.run(work).await
    }

    /// The same record with its own thread pool, so that computations of others cannot delay its own.
    #[must_use]
    pub fn with_own_pool(&self) -> Self {
        Self { pool: Pool::default(), ..self.clone() }
    }

    /// Begins a write transaction. Dropping it without [`commit`] rolls it back.
    ///
    /// # Errors
    /// If no transaction can be started.
    pub async fn write(&self) -> StoreResult<BorrowedWriter<'_>> {
        Ok(Borrowed::new(self.writing.begin().await?))
    }

    /// Sets the free space below which nothing large is started.
    pub fn set_reserve(&self, bytes: u64) {
        self.writing.space().set_reserve(bytes);
    }

    /// Fails if less space is free than the reserve.
    ///
    /// # Errors
    /// [`StoreError::NearlyFull`].
    pub fn check_free_space(&self) -> StoreResult<()> {
        self.writing.space().check_free_space()
    }

    /// Free space on the disk of the record, if the system reports it.
    pub fn free_bytes(&self) -> Option<u64> {
        self.writing.space().free_bytes()
    }

    /// Refuses a file beside the record, or elsewhere on its disk, that would leave less free than is kept in reserve.
    fn room_for_copy(&self, to: &Path) -> StoreResult<()> {
        let bytes = std::fs::metadata(&self.path).map_or(0, |about| about.len());
        if self.writing.space().holds(to) { self.writing.space().check_free_space_for(bytes) } else { Ok(()) }
    }

    /// Tests whether the record accepts changes, by a durable write without effect. The result is cached for a second.
    ///
    /// # Errors
    /// Why the record cannot be written.
    pub async fn probe(&self) -> Result<(), String> {
        let mut last = self.probed.lock().await;
        if let Some((at, found)) = &*last
            && at.elapsed() < PROBE_INTERVAL
        {
            return found.clone();
        }
        let found = match tokio::time::timeout(PROBE_TIMEOUT, self.write_nothing()).await {
            Ok(Ok(())) if !self.writing.space().has_room_for_change() => {
                Err("the disk that holds the record is full".to_owned())
            }
            Ok(written) => written.map_err(|error| error.to_string()),
            Err(_) => Err(format!("a test write took longer than {} s", PROBE_TIMEOUT.as_secs())),
        };
        *last = Some((std::time::Instant::now(), found.clone()));
        found
    }

    /// Rewrites a header field of the file with its current value.
    async fn write_nothing(&self) -> StoreResult<()> {
        let mut writer = self.write().await?;
        let row = sqlx::query("pragma user_version").fetch_one(&mut **writer).await?;
        let version: i64 = sqlx::Row::try_get(&row, 0)?;
        sqlx::query(sqlx::AssertSqlSafe(format!("pragma user_version = {version}"))).execute(&mut **writer).await?;
        commit(writer).await
    }

    /// The path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Closes every connection, merges the write-ahead log into the file, and releases the ownership.
    pub async fn close(&self) {
        self.readers.close().await;
        self.writing.close().await;
        drop(self.record_lock.lock().await.take());
    }
}

/// Commits a transaction durably.
///
/// # Errors
/// Errors of the database. The transaction is rolled back then.
pub async fn commit(mut writer: BorrowedWriter<'_>) -> StoreResult<()> {
    seals::seal(&mut writer).await?;
    writer.into_writer().commit().await
}

/// SHA-256, hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    json_columns::sha256(bytes)
}
