//! Opens and checks a record without changing it.

use super::record_file_names::path_with_suffix;
use super::{StoreError, StoreResult, interrupted_restore, quarantine, schema_versions, sqlite_file};
use sqlx::sqlite::{SqliteConnectOptions, SqlitePoolOptions};
use sqlx::{Row, SqlitePool};
use std::path::{Path, PathBuf};

/// Checks that a file is an intact record of a known version.
///
/// # Errors
/// [`StoreError::NewerSchema`], [`StoreError::DevelopmentSchema`], [`StoreError::Damaged`] with the finding of the database.
pub async fn check(file: &Path) -> StoreResult<()> {
    let pool = open(file).await?;
    let found = check_open(&pool).await;
    pool.close().await;
    found
}

/// Opens a record read-only, even if another process owns it or its folder is not writable.
///
/// # Errors
/// [`StoreError::Open`], [`StoreError::NotADatabase`], [`StoreError::NewerSchema`],
/// [`StoreError::DevelopmentSchema`].
pub async fn open(file: &Path) -> StoreResult<SqlitePool> {
    interrupted_restore::refuse_interrupted(file)?;
    sqlite_file::check(file)?;
    let options = SqliteConnectOptions::new().filename(file).create_if_missing(false).read_only(true);
    // Small, because a row may contain a whole measurement file.
    let options = options.row_buffer_size(quarantine::ROWS_AHEAD);
    let refused = match connect(options.clone(), file).await {
        Err(error @ StoreError::Open { .. }) => error,
        other => return other,
    };
    // In a read-only folder SQLite cannot create its shared memory. Without a log it needs none; with one, open a copy
    // of both.
    let log = path_with_suffix(file, "-wal");
    if std::fs::metadata(&log).map_or(0, |log| log.len()) == 0 {
        return connect(options.immutable(true), file).await;
    }
    let Ok(folder) = private_folder() else { return Err(refused) };
    let copy = folder.join("record.db");
    let copied = std::fs::copy(file, &copy).and_then(|_| std::fs::copy(&log, path_with_suffix(&copy, "-wal")));
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
    let pool = one.connect_with(options).await.map_err(|error| sqlite_file::named(file, error.into()))?;
    let refusal =
        match schema_versions::check_version(&pool, file).await.map_err(|error| sqlite_file::named(file, error)) {
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

/// Checks the file and the references between rows of an open record.
///
/// # Errors
/// [`StoreError::Damaged`] with the finding of the database.
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
