//! Putting a copy in place of a record. That is done when the record is damaged, or of a newer version: nothing here
//! opens it.

use super::{StoreError, StoreResult, backup, beside, free_name, take_ownership};
use std::fs::File;
use std::path::{Path, PathBuf};

/// What SQLite keeps beside the file of a record.
const COMPANIONS: [&str; 2] = ["-wal", "-shm"];

/// Puts a copy in place of a record and returns where the record that was there is kept.
///
/// # Errors
/// [`StoreError::InUse`] while a process owns the record, what [`backup::check`] finds in the copy, or that a file cannot
/// be written; the record is as it was then.
pub async fn from_file(from: &Path, to: &Path) -> StoreResult<Option<PathBuf>> {
    backup::check(from).await?;
    let (_owner, _) = take_ownership(to)?;
    let cannot_write = |source| StoreError::Open { path: to.to_owned(), source };
    // What a restore left that was killed.
    let part = beside(to, ".restored.part");
    if part.exists() {
        std::fs::remove_file(&part).map_err(cannot_write)?;
    }
    // Not a copy of the file: a part of the record may be in the log beside it.
    backup::of_file(from, &part).await?;
    let kept = to.exists().then(|| free_name(to, "before"));
    let moved = File::open(&part).and_then(|file| file.sync_all()).and_then(|()| put(&part, to, kept.as_deref()));
    if moved.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    moved.map_err(cannot_write)?;
    Ok(kept)
}

fn put(part: &Path, to: &Path, kept: Option<&Path>) -> std::io::Result<()> {
    // Until the last step there is a record in its place, whenever this is killed.
    if let Some(kept) = kept {
        for ending in ["", COMPANIONS[0]] {
            let present = beside(to, ending);
            if present.exists() {
                std::fs::copy(&present, beside(kept, ending))?;
                File::open(beside(kept, ending))?.sync_all()?;
            }
        }
    }
    // The log of another record would be taken for one of the copy.
    for present in COMPANIONS.map(|ending| beside(to, ending)) {
        if present.exists() {
            std::fs::remove_file(present)?;
        }
    }
    std::fs::rename(part, to)?;
    let folder = to.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    File::open(folder)?.sync_all()
}
