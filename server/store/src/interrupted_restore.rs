//! A restore that was killed: the marker that it left beside the record, and how the next owner of the record finishes or
//! undoes it.

use super::anchor::{self, ChainEnds};
use super::atomic_file::{WholeFile, sync_folder};
use super::record_file_names::path_with_suffix;
use super::{StoreError, StoreResult, json_columns};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

/// SQLite's companion files.
pub(super) const COMPANIONS: [&str; 2] = ["-wal", "-shm"];

/// A step of a restore that is on the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RestoreStep {
    OldRecordKept,
    Marked,
    Renamed,
    LogRemoved,
    Anchored,
}

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
fn read(record: &Path) -> StoreResult<Option<Marker>> {
    let path = marker_of(record);
    match std::fs::read_to_string(&path) {
        Ok(text) => json_columns::from_text("restore", &text).map(Some),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(source) => Err(StoreError::Open { path, source }),
    }
}

/// Removes the marker durably: with a later change in the log, it would cost that change.
fn unmark(record: &Path) -> StoreResult<()> {
    let path = marker_of(record);
    let removed = std::fs::remove_file(&path).and_then(|()| sync_folder(record));
    removed.map_err(|source| StoreError::Open { path, source })
}

/// Finishes the restore of a killed process if the backup has the name of the record, and forgets it otherwise. To be
/// called by the owner of the record, before the record is opened.
pub(super) fn finish_interrupted(record: &Path) -> StoreResult<()> {
    let Some(marker) = read(record)? else { return Ok(()) };
    let is_renamed = match hash_of(record) {
        Err(error) if error.kind() == ErrorKind::NotFound => false,
        hash => hash.map_err(|source| StoreError::Open { path: record.to_owned(), source })? == marker.sha256,
    };
    if is_renamed {
        finish(record, &marker, &|_| {})?;
        tracing::warn!(record = %record.display(), "an interrupted restore was finished: the record now has the contents of the backup");
    } else {
        unmark(record)?;
        tracing::warn!(record = %record.display(), "an interrupted restore was undone: the record is as it was before");
    }
    Ok(())
}

/// Removes the log of the old record, which must not be used with the backup, and updates the anchors.
pub(super) fn finish(record: &Path, marker: &Marker, reached: &dyn Fn(RestoreStep)) -> StoreResult<()> {
    let others = COMPANIONS.map(|ending| path_with_suffix(record, ending));
    for path in others.into_iter().filter(|path| path.exists()) {
        std::fs::remove_file(&path).map_err(|source| StoreError::Open { path, source })?;
    }
    sync_folder(record).map_err(|source| StoreError::Open { path: record.to_owned(), source })?;
    reached(RestoreStep::LogRemoved);
    let own_anchor = anchor::path_of(record);
    for anchor in std::iter::once(&own_anchor).chain(&marker.elsewhere) {
        anchor::put(anchor, &marker.ends)?;
    }
    reached(RestoreStep::Anchored);
    unmark(record)
}

/// SHA-256 of a file in hexadecimal digits.
pub(super) fn hash_of(file: &Path) -> io::Result<String> {
    let (mut file, mut hash, mut bytes) = (File::open(file)?, Sha256::new(), vec![0; 1 << 20]);
    loop {
        match file.read(&mut bytes)? {
            0 => return Ok(hex::encode(hash.finalize())),
            read => hash.update(bytes.get(..read).unwrap_or_default()),
        }
    }
}
