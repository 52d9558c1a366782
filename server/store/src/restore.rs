//! Putting a copy in place of a record. That is done when the record is damaged, or of a newer version: nothing here
//! opens it.

use super::ownership::Ownership;
use super::whole_file::{WholeFile, sync_folder};
use super::{StoreError, StoreResult, anchor, backup, beside, free_name};
use std::fs::File;
use std::path::{Path, PathBuf};

/// What SQLite keeps beside the file of a record.
const COMPANIONS: [&str; 2] = ["-wal", "-shm"];

/// Puts a copy in place of a record and returns where the record that was there is kept. The anchors then hold what the
/// copy ends with: that an earlier state took the place of a later one was meant.
///
/// # Errors
/// [`StoreError::InUse`] while a process owns the record, what [`backup::check`] finds in the copy, or that a file cannot
/// be written; the record is as it was then.
pub async fn from_file(from: &Path, to: &Path, elsewhere: Option<&Path>) -> StoreResult<Option<PathBuf>> {
    backup::check(from).await?;
    let _owner = Ownership::take(to)?;
    let cannot_write = |source| StoreError::Open { path: to.to_owned(), source };
    // Not a copy of the file: a part of the record may be in the log beside it.
    let pool = backup::open_read_only(from).await?;
    let copied = async {
        let ends = anchor::ends(&mut *pool.acquire().await?).await?;
        Ok::<_, StoreError>((ends, backup::whole_copy(&pool, to, to).await?))
    };
    let copied = copied.await;
    pool.close().await;
    let (ends, copy) = copied?;
    let kept = to.exists().then(|| free_name(to, "before"));
    let beside_record = anchor::beside_record(to);
    put(copy, to, kept.as_deref(), &beside_record).map_err(cannot_write)?;
    for anchor in std::iter::once(beside_record.as_path()).chain(elsewhere) {
        anchor::put(anchor, &ends)?;
    }
    Ok(kept)
}

fn put(copy: WholeFile, to: &Path, kept: Option<&Path>, anchor: &Path) -> std::io::Result<()> {
    // Until the last step there is a record in its place, whenever this is killed.
    if let Some(kept) = kept {
        let family = to.file_name().unwrap_or_default().to_string_lossy();
        for ending in ["", COMPANIONS[0], ".anchor"] {
            let present = beside(to, ending);
            if present.exists() {
                let target = beside(kept, ending);
                let mut whole = WholeFile::begin(&target, &family)?;
                std::io::copy(&mut File::open(&present)?, whole.file())?;
                whole.keep_as(&target)?;
            }
        }
        like(to, copy.part());
    }
    // The log of another record would be taken for one of the copy, and so would its anchor.
    let others = COMPANIONS.map(|ending| beside(to, ending));
    for present in others.iter().map(PathBuf::as_path).chain([anchor]) {
        if present.exists() {
            std::fs::remove_file(present)?;
        }
    }
    sync_folder(to)?;
    copy.replace(to)
}

/// Whoever could use the record that was there can use the one in its place.
fn like(present: &Path, copy: &Path) {
    #[cfg(unix)]
    if let Ok(about) = std::fs::metadata(present) {
        use std::os::unix::fs::MetadataExt;
        // Refused unless root restores for somebody else; then the copy belongs to who made it, as before.
        let _ = std::os::unix::fs::chown(copy, Some(about.uid()), Some(about.gid()));
    }
    #[cfg(not(unix))]
    let _ = (present, copy);
}
