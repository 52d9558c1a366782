//! Migrates a record at start, in one transaction, after a backup.

use super::record_files::path_with_suffix;
use super::schema_versions::{SCHEMA_VERSION, check_version, up_to};
use super::{StoreError, StoreResult, backup, seals, verify};
use sqlx::SqlitePool;
use std::path::{Path, PathBuf};

/// Length of the header of an SQLite file.
const SQLITE_HEADER_BYTES: usize = 100;

/// Verifies a record, migrates it, and seals the rows that the migrations wrote, in one transaction. Refuses a record
/// that another program changed, and leaves it unchanged.
pub(super) async fn apply(pool: &SqlitePool, path: &Path) -> StoreResult<()> {
    let found = check_version(pool, path).await?;
    back_up_before(pool, path, found).await?;
    let mut change = pool.begin().await?;
    if found > 0 {
        verify::rows(&mut change, found).await?;
    }
    if found < SCHEMA_VERSION {
        let before = seals::present(&mut change).await?;
        seals::watch_migrations(&mut change).await?;
        up_to(SCHEMA_VERSION).run_direct(None, &mut *change, false).await?;
        seals::adopt(&mut change, &before).await?;
        seals::end_watch(&mut change).await?;
    }
    Ok(change.commit().await?)
}

/// Backs up a file before a migration, as `gaitwright.db.v1`.
async fn back_up_before(pool: &SqlitePool, path: &Path, found: i64) -> StoreResult<()> {
    if found == 0 || found == SCHEMA_VERSION {
        return Ok(());
    }
    let name = path_with_suffix(path, &format!(".v{found}"));
    let cannot_write = |source| StoreError::Open { path: name.clone(), source };
    let copy = backup::whole_copy(pool, path, &name, path).await?;
    match free_name(&name, copy.part()).map_err(cannot_write)? {
        Some(free) => copy.keep_as(&free).map_err(cannot_write),
        None => Ok(()),
    }
}

/// The name itself, or with a number if another record has it; `None` if this record was already copied.
fn free_name(name: &Path, part: &Path) -> std::io::Result<Option<PathBuf>> {
    // The header of an SQLite file has a change counter, so compare only what follows it.
    let content =
        |file: &Path| std::fs::read(file).map(|bytes| bytes.into_iter().skip(SQLITE_HEADER_BYTES).collect::<Vec<u8>>());
    let mut candidate = name.to_owned();
    let mut number = 1_u32;
    while candidate.exists() {
        if content(&candidate)? == content(part)? {
            return Ok(None);
        }
        number += 1;
        candidate = path_with_suffix(name, &format!("-{number}"));
    }
    Ok(Some(candidate))
}
