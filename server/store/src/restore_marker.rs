//! The marker beside a record that a restore has begun to replace.

use super::anchor::ChainEnds;
use super::atomic_file::{WholeFile, sync_folder};
use super::record_files::path_with_suffix;
use super::{StoreError, StoreResult, json_columns};
use serde::{Deserialize, Serialize};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// A restore that has begun to replace a record.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Marker {
    /// Hash of the backup, which tells whether it has the name of the record.
    pub(super) sha256: String,
    /// The last rows of its chains, for the anchors.
    pub(super) ends: ChainEnds,
    /// The second anchor.
    pub(super) elsewhere: Option<PathBuf>,
}

/// The path of the marker beside a record.
fn marker_of(record: &Path) -> PathBuf {
    path_with_suffix(record, ".restoring")
}

/// Writes the marker durably.
pub(super) fn mark(record: &Path, marker: &Marker) -> StoreResult<()> {
    let (path, text) = (marker_of(record), json_columns::to_text("restore", marker)?);
    let family = record.file_name().unwrap_or_default().to_string_lossy();
    let written = WholeFile::begin(&path, &family).and_then(|mut whole| {
        whole.file().write_all(text.as_bytes())?;
        whole.replace(&path)
    });
    written.map_err(|source| StoreError::Open { path, source })
}

/// Refuses to read a record that a killed restore left half replaced.
pub(super) fn refuse_interrupted(record: &Path) -> StoreResult<()> {
    if marker_of(record).exists() {
        return Err(StoreError::RestoreInterrupted { path: record.to_owned() });
    }
    Ok(())
}

/// The marker of a restore that a killed process began, if there is one.
pub(super) fn read(record: &Path) -> StoreResult<Option<Marker>> {
    let path = marker_of(record);
    match std::fs::read_to_string(&path) {
        Ok(text) => json_columns::from_text("restore", &text).map(Some),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(source) => Err(StoreError::Open { path, source }),
    }
}

/// Removes the marker durably: with a later change in the log, it would cost that change.
pub(super) fn unmark(record: &Path) -> StoreResult<()> {
    let path = marker_of(record);
    let removed = std::fs::remove_file(&path).and_then(|()| sync_folder(record));
    removed.map_err(|source| StoreError::Open { path, source })
}
