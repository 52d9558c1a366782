//! Copies of the record: consistent while the service runs, checked before they are trusted.

use super::{Store, StoreError, StoreResult, free_name};
use super::{file_kind, migrations};
use sqlx::sqlite::{SqliteConnectOptions, SqlitePoolOptions};
use sqlx::{Row, SqlitePool};
use std::path::{Path, PathBuf};

/// Writes a compact copy of an open record to a new file and checks the copy.
///
/// # Errors
/// When the file exists, cannot be written, or the copy is not whole.
pub async fn of_store(store: &Store, to: &Path) -> StoreResult<()> {
    into_file(&store.readers, to).await
}

/// Writes a compact copy beside the record (`gaitwright.db.backup-20260501T101500`) and checks it: the file and its size.
///
/// # Errors
/// As [`of_store`].
pub async fn beside_record(store: &Store) -> StoreResult<(PathBuf, u64)> {
    let _turn = store.copying.lock().await;
    let to = free_name(store.path(), "backup");
    of_store(store, &to).await?;
    let size = std::fs::metadata(&to).map_err(|source| StoreError::Open { path: to.clone(), source })?.len();
    Ok((to, size))
}

/// The copies that lie beside the record under the names that this program gives them, newest first: name and bytes.
///
/// # Errors
/// When the folder cannot be read.
pub fn those_beside(record: &Path) -> std::io::Result<Vec<(String, i64)>> {
    let own = record.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let folder = record.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let kind = name.strip_prefix(&own).and_then(|rest| rest.strip_prefix('.'));
        // `backup-20260501T101500`, made when asked for; `v42`, made before a new version changed the form.
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

/// Writes a compact copy of a record that another process may own, and checks the copy.
///
/// # Errors
/// As [`of_store`].
pub async fn of_file(from: &Path, to: &Path) -> StoreResult<()> {
    let pool = open_read_only(from).await?;
    let done = into_file(&pool, to).await;
    pool.close().await;
    done
}

/// Checks that a file is a whole record of a version that this program knows.
///
/// # Errors
/// [`StoreError::NewerSchema`], [`StoreError::Damaged`] with what the database found.
pub async fn check(file: &Path) -> StoreResult<()> {
    let pool = open_read_only(file).await?;
    let found = check_open(&pool).await;
    pool.close().await;
    found
}

/// A connection to read a record that another process may own.
///
/// # Errors
/// When it cannot be opened, [`StoreError::NotADatabase`], [`StoreError::NewerSchema`].
pub async fn open_read_only(file: &Path) -> StoreResult<SqlitePool> {
    file_kind::check(file)?;
    let options = SqliteConnectOptions::new().filename(file).create_if_missing(false).read_only(true);
    // A row may hold a whole recording.
    let options = options.row_buffer_size(super::quarantine::ROWS_AHEAD);
    let pool = SqlitePoolOptions::new().max_connections(1).connect_with(options).await?;
    let refusal = match migrations::check_version(&pool, file).await.map_err(|error| file_kind::named(file, error)) {
        Ok(0) => StoreError::NotADatabase { path: file.to_owned(), reason: "it holds no record yet".to_owned() },
        Ok(_) => return Ok(pool),
        Err(error) => error,
    };
    pool.close().await;
    Err(refusal)
}

/// Writes a compact copy to a new file and checks the copy.
pub(super) async fn into_file(pool: &SqlitePool, to: &Path) -> StoreResult<()> {
    if to.exists() {
        let source = std::io::ErrorKind::AlreadyExists.into();
        return Err(StoreError::Open { path: to.to_owned(), source });
    }
    sqlx::query("vacuum into ?").bind(to.to_string_lossy().into_owned()).execute(pool).await?;
    let whole = check(to).await;
    if whole.is_err() {
        // A copy that is not whole is none.
        let _ = std::fs::remove_file(to);
    }
    whole
}

async fn check_open(pool: &SqlitePool) -> StoreResult<()> {
    let damaged = |reason: String| StoreError::Damaged { what: "database file", reason };
    let integrity: String = sqlx::query("pragma integrity_check").fetch_one(pool).await?.try_get(0)?;
    if integrity != "ok" {
        return Err(damaged(integrity));
    }
    if let Some(row) = sqlx::query("pragma foreign_key_check").fetch_optional(pool).await? {
        let table: String = row.try_get(0)?;
        return Err(damaged(format!("a row of {table} points at nothing")));
    }
    Ok(())
}
