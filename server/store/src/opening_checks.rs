//! Checks of a file before it is opened as a record: not another program's, not an earlier state, not an empty file in
//! place of a record, and every row verified.

use super::record_file_names::path_with_suffix;
use super::schema_versions::SchemaFile;
use super::{StoreError, StoreResult, anchor, migrations, record_lock, schema_versions, sqlite_file, verify};
use sqlx::SqlitePool;
use sqlx::sqlite::{SqliteConnectOptions, SqlitePoolOptions};
use std::path::{Path, PathBuf};

/// Refuses a file of another program, of a development version or of a newer one, before a writing connection opens it.
pub(super) async fn refuse_unchanged(path: &Path) -> StoreResult<()> {
    if !std::fs::metadata(path).is_ok_and(|file| file.len() > 0) {
        return Ok(());
    }
    let options = SqliteConnectOptions::new().filename(path).read_only(true);
    let Ok(pool) = SqlitePoolOptions::new().max_connections(1).connect_with(options).await else { return Ok(()) };
    let checked = schema_versions::check_version(&pool, path).await;
    pool.close().await;
    match checked {
        Err(
            refusal @ (StoreError::NotADatabase { .. }
            | StoreError::NewerSchema { .. }
            | StoreError::DevelopmentSchema { .. }),
        ) => Err(refusal),
        // A file that cannot be read without writing, such as one with a hot journal, is checked by the next
        // connection.
        _ => Ok(()),
    }
}

/// Checks a path that may have no record yet, as opening it does, and creates nothing.
///
/// # Errors
/// [`StoreError::WrongAnchor`], [`StoreError::NoAnchorFolder`], [`StoreError::NoFileName`], [`StoreError::NotADatabase`],
/// [`StoreError::SeveralNames`], [`StoreError::Open`] and [`StoreError::RecordMissing`], as [`super::Store::open_anchored`].
pub fn check_path(path: &Path, second_anchor: Option<&Path>) -> StoreResult<()> {
    anchor::refuse_wrong(second_anchor, path, None)?;
    sqlite_file::check(path)?;
    record_lock::check(path)?;
    refuse_unwritable_companions(path)?;
    refuse_empty_in_place_of_record(path, &anchors(path, second_anchor))
}

/// Refuses files beside the record that its owner could not write. An owner checks them behind its lock, because closing one
/// of SQLite's files releases the locks of another connection of the same process.
pub(super) fn refuse_unwritable_companions(path: &Path) -> StoreResult<()> {
    let companions = ["-wal", "-shm", ".access"];
    companions.into_iter().try_for_each(|ending| record_lock::refuse_unwritable(&path_with_suffix(path, ending)))
}

/// The anchors of a record.
pub(super) fn anchors(path: &Path, second: Option<&Path>) -> Vec<PathBuf> {
    [Some(anchor::path_of(path)), second.map(Path::to_owned)].into_iter().flatten().collect()
}

/// Accepts an empty file as a new record, unless an anchor shows that there was one.
pub(super) fn refuse_empty_in_place_of_record(path: &Path, anchors: &[PathBuf]) -> StoreResult<()> {
    let bytes = |file: &Path| std::fs::metadata(file).map_or(0, |file| file.len());
    if bytes(path) > 0 {
        return Ok(());
    }
    let log = path_with_suffix(path, "-wal");
    if bytes(&log) > 0 {
        return Err(StoreError::RecordMissing { path: path.to_owned(), evidence: log });
    }
    refuse_to_begin_anew(path, anchors)
}

/// Refuses a file that is not the record which its companions know: another program's, an earlier state, or an empty file
/// in its place.
pub(super) async fn check_history(pool: &SqlitePool, path: &Path, anchors: &[PathBuf]) -> StoreResult<()> {
    if schema_versions::check_version(pool, path).await? == 0 {
        return refuse_to_begin_anew(path, anchors);
    }
    for anchor in anchors {
        anchor::check(&mut *pool.acquire().await?, path, anchor).await?;
    }
    Ok(())
}

/// Verifies a record and migrates it, in one transaction, after a backup. Refuses a record that another program changed, and
/// leaves it unchanged.
pub(super) async fn verify_and_migrate(pool: &SqlitePool, path: &Path, files: &[SchemaFile]) -> StoreResult<()> {
    let found = schema_versions::check_version(pool, path).await?;
    let is_newest = files.iter().all(|(version, ..)| *version <= found);
    if found > 0 && !is_newest {
        migrations::back_up_before(pool, path, found).await?;
    }
    let mut change = pool.begin().await?;
    if found > 0 {
        verify::rows(&mut change, found).await?;
    }
    if !is_newest {
        migrations::apply(&mut change, files).await?;
    }
    Ok(change.commit().await?)
}

/// Refuses a file without a schema if an anchor shows that its log was lost.
fn refuse_to_begin_anew(path: &Path, anchors: &[PathBuf]) -> StoreResult<()> {
    for anchor in anchors {
        if anchor::has_seen_rows(anchor)? {
            return Err(StoreError::RecordMissing { path: path.to_owned(), evidence: anchor.clone() });
        }
    }
    Ok(())
}
