//! Backups of the record: consistent while the service is running, and verified.

use super::atomic_file::folder_of;
use super::record_file_names::free_name;
use super::verified_copy::{cannot_write, whole_copy};
use super::{Store, StoreError, StoreResult, read_only};
use sqlx::SqlitePool;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Writes a compact backup of an open record to a new file and verifies it.
///
/// # Errors
/// If the file exists or cannot be written, and [`StoreError::Unverified`] if the record is damaged.
pub async fn of_store(store: &Store, to: &Path) -> StoreResult<()> {
    into_file(&store.readers, to, store.path()).await
}

/// Writes a backup next to the record (`gaitwright.db.backup-20260501T101500`) and verifies it. Returns the file and its
/// size.
///
/// # Errors
/// As [`of_store`], and [`StoreError::NearlyFull`].
pub async fn to_record_folder(store: &Store) -> StoreResult<(PathBuf, u64)> {
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
pub fn check_free_space(store: &Store) -> StoreResult<()> {
    store.room_for_copy(store.path())
}

/// The backups next to the record, newest first, with their names and sizes.
///
/// # Errors
/// If the folder cannot be read.
pub fn in_record_folder(record: &Path) -> std::io::Result<Vec<(String, i64)>> {
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

/// Writes a compact backup of a record that another process may own, and verifies it.
///
/// # Errors
/// As [`of_store`].
pub async fn of_file(from: &Path, to: &Path) -> StoreResult<()> {
    let pool = read_only::open(from).await?;
    let done = into_file(&pool, to, from).await;
    pool.close().await;
    done
}

/// Writes a compact backup to a new file, verifies it, and gives it its name.
async fn into_file(pool: &SqlitePool, to: &Path, record: &Path) -> StoreResult<()> {
    if to.exists() {
        return Err(cannot_write(to, ErrorKind::AlreadyExists.into()));
    }
    whole_copy(pool, record, to, record).await?.keep_as(to).map_err(|error| cannot_write(to, error))
}
