//! Copies of a record that are verified before they get their name.

use super::atomic_file::WholeFile;
use super::{StoreError, StoreResult, verify};
use sqlx::SqlitePool;
use std::io::ErrorKind;
use std::path::Path;

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
        Err(error @ (StoreError::Damaged { .. } | StoreError::UnknownValue { .. } | StoreError::Unsealed { .. })) => {
            Err(StoreError::Unverified {
                path: from.to_owned(),
                reason: format!("It has this fault: {}.", error.finding()),
            })
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
