//! Backups of the record: consistent while the service is running, and verified.

use super::whole_file::{WholeFile, folder_of};
use super::{Store, StoreError, StoreResult, beside, file_kind, free_name, restore, schema_versions, verify};
use sqlx::sqlite::{SqliteConnectOptions, SqlitePoolOptions};
use sqlx::{Row, SqlitePool};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Writes a compact backup of an open record to a new file and verifies it.
///
/// # Errors
/// If the file exists or cannot be written, and [`StoreError::Unverified`] if the record is damaged.
pub async fn of_store(store: &Store, to: &Path) -> StoreResult<()> {
    into_file(&store.readers, to, store.path()).await
}

/// Writes a backup next to the record (`gaitwright.db.backup-20260501T101500`) and checks it. Returns the file and its
/// size.
///
/// # Errors
/// As [`of_store`], and [`StoreError::NearlyFull`].
pub async fn beside_record(store: &Store) -> StoreResult<(PathBuf, u64)> {
    let _turn = store.copying.lock().await;
    let to = free_name(store.path(), "backup");
    store.room_for_copy(&to)?;
    of_store(store, &to).await?;
    let size = std::fs::metadata(&to).map_err(|source| StoreError::Open { path: to.clone(), source })?.len();
    Ok((to, size))
}

/// Refuses a backup next to the record that would leave less free space than is kept in reserve.
///
/// # Errors
/// [`StoreError::NearlyFull`].
pub fn room(store: &Store) -> StoreResult<()> {
    store.room_for_copy(store.path())
}

/// The backups next to the record, newest first, with their names and sizes.
///
/// # Errors
/// If the folder cannot be read.
pub fn those_beside(record: &Path) -> std::io::Result<Vec<(String, i64)>> {
    let own = record.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder_of(record))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let kind = name.strip_prefix(&own).and_then(|rest| rest.strip_prefix('.'));
        // `backup-20260501T101500` was made on request, `v42` before a migration.
        let is_copy = |kind: &str| {
            let of_form = |rest: &str| rest.starts_with(|c: char| c.is_ascii_digit()) && !rest.contains('.');
            kind.starts_with("backup-") || kind.strip_prefix('v').is_some_and(of_form)
        };
        if kind.is_some_and(is_copy) {
            let about = entry.metadata()?;
            found.push((about.modified()?, name, i64::try_from(about.len()).unwrap_or(i64::MAX)));
        }
    }
    found.sort();
    Ok(found.into_iter().rev().map(|(_, name, bytes)| (name, bytes)).collect())
}

/// Writes a compact backup of a record that another process may own, and checks it.
///
/// # Errors
/// As [`of_store`].
pub async fn of_file(from: &Path, to: &Path) -> StoreResult<()> {
    let pool = open_read_only(from).await?;
    let done = into_file(&pool, to, from).await;
    pool.close().await;
    done
}

/// Checks that a file is an intact record of a known version.
///
/// # Errors
/// [`StoreError::NewerSchema`], [`StoreError::Damaged`] with the finding of the database.
pub async fn check(file: &Path) -> StoreResult<()> {
    let pool = open_read_only(file).await?;
    let found = check_open(&pool).await;
    pool.close().await;
    found
}

/// Opens a record read-only, even if another process owns it or its folder is not writable.
///
/// # Errors
/// [`StoreError::Open`], [`StoreError::NotADatabase`], [`StoreError::NewerSchema`].
pub async fn open_read_only(file: &Path) -> StoreResult<SqlitePool> {
    restore::refuse_interrupted(file)?;
    file_kind::check(file)?;
    let options = SqliteConnectOptions::new().filename(file).create_if_missing(false).read_only(true);
    // Small, because a row may contain a whole measurement file.
    let options = options.row_buffer_size(super::quarantine::ROWS_AHEAD);
    let refused = match connect(options.clone(), file).await {
        Err(error @ StoreError::Open { .. }) => error,
        other => return other,
    };
    // In a read-only folder SQLite cannot create its shared memory. Without a log it needs none; with one, open a copy
    // of both.
    let log = beside(file, "-wal");
    if std::fs::metadata(&log).map_or(0, |log| log.len()) == 0 {
        return connect(options.immutable(true), file).await;
    }
    let Ok(folder) = private_folder() else { return Err(refused) };
    let copy = folder.join("record.db");
    let copied = std::fs::copy(file, &copy).and_then(|_| std::fs::copy(&log, beside(&copy, "-wal")));
    let opened = match copied {
        Ok(_) => connect(SqliteConnectOptions::new().filename(&copy), file).await,
        Err(source) => Err(StoreError::Open { path: file.to_owned(), source }),
    };
    // Open files stay readable after they are deleted.
    let _ = std::fs::remove_dir_all(&folder);
    opened
}

/// A pool of one connection that stays open.
async fn connect(options: SqliteConnectOptions, file: &Path) -> StoreResult<SqlitePool> {
    let one = SqlitePoolOptions::new().max_connections(1).idle_timeout(None).max_lifetime(None);
    let pool = one.connect_with(options).await.map_err(|error| file_kind::named(file, error.into()))?;
    let refusal = match schema_versions::check_version(&pool, file).await.map_err(|error| file_kind::named(file, error))
    {
        Ok(0) => StoreError::NotADatabase { path: file.to_owned(), reason: "it contains no record yet".to_owned() },
        Ok(_) => return Ok(pool),
        Err(error) => error,
    };
    pool.close().await;
    Err(refusal)
}

/// Creates a folder that only its owner can open.
fn private_folder() -> std::io::Result<PathBuf> {
    let folder = std::env::temp_dir().join(format!("gaitwright-{}", uuid::Uuid::now_v7()));
    #[allow(unused_mut, reason = "only mutated on Unix")]
    let mut builder = std::fs::DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(&folder)?;
    Ok(folder)
}

/// Writes a compact backup to a new file, verifies it, and gives it its name.
async fn into_file(pool: &SqlitePool, to: &Path, record: &Path) -> StoreResult<()> {
    if to.exists() {
        return Err(cannot_write(to, ErrorKind::AlreadyExists.into()));
    }
    whole_copy(pool, record, to, record).await?.keep_as(to).map_err(|error| cannot_write(to, error))
}

/// Writes a compact copy of the record or backup `from` that has no final name yet, and verifies its rows, seals and
/// chains. `family` is the record whose leftovers in the same folder are deleted.
pub(super) async fn whole_copy(pool: &SqlitePool, from: &Path, to: &Path, family: &Path) -> StoreResult<WholeFile> {
    let family = family.file_name().unwrap_or_default().to_string_lossy();
    let copy = WholeFile::begin(to, &family).map_err(|error| cannot_write(to, error))?;
    let written = sqlx::query("vacuum into ?").bind(copy.part().to_string_lossy().into_owned()).execute(pool).await;
    written.map_err(|error| match StoreError::from(error) {
        full if full.is_full() => StoreError::CopyFull { path: to.to_owned() },
        other => other,
    })?;
    match verify::file(copy.part(), &[]).await {
        Ok(_) => Ok(copy),
        Err(error @ (StoreError::Damaged { .. } | StoreError::Unsealed { .. })) => {
            Err(StoreError::Unverified { path: from.to_owned(), reason: error.to_string() })
        }
        Err(error) => Err(error),
    }
}

/// The error for a copy that cannot be written.
pub(super) fn cannot_write(to: &Path, source: std::io::Error) -> StoreError {
    let path = to.to_owned();
    match source.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => StoreError::CopyFull { path },
        _ => StoreError::Open { path, source },
    }
}

pub(super) async fn check_open(pool: &SqlitePool) -> StoreResult<()> {
    let damaged = |reason: String| StoreError::Damaged { what: "database file", reason };
    let integrity: String = sqlx::query("pragma integrity_check").fetch_one(pool).await?.try_get(0)?;
    if integrity != "ok" {
        return Err(damaged(integrity));
    }
    if let Some(row) = sqlx::query("pragma foreign_key_check").fetch_optional(pool).await? {
        let table: String = row.try_get(0)?;
        return Err(damaged(format!("a row of {table} refers to a missing row")));
    }
    Ok(())
}
