//! Replaces a record with a backup. The old record may be damaged or of a newer version, so it is never opened.

use super::ownership::Ownership;
use super::whole_file::{WholeFile, sync_folder};
use super::{StoreError, StoreResult, anchor, backup, beside, free_name};
use std::fs::File;
use std::path::{Path, PathBuf};

/// SQLite's companion files.
const COMPANIONS: [&str; 2] = ["-wal", "-shm"];

/// Replaces a record with a backup, and updates the anchors to it. Returns where the old record is kept.
///
/// # Errors
/// [`StoreError::InUse`] while a process owns the record, errors of [`backup::check`] for the backup, or a file that
/// cannot be written. The record is unchanged then.
pub async fn from_file(from: &Path, to: &Path, elsewhere: Option<&Path>) -> StoreResult<Option<PathBuf>> {
    backup::check(from).await?;
    let _owner = Ownership::take(to)?;
    let cannot_write = |source| StoreError::Open { path: to.to_owned(), source };
    // Copy through SQLite, because part of the backup may be in its log.
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
    // If the process is killed before the last step, the old record is still in place.
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
    // The log and the anchor of the old record must not be used with the backup.
    let others = COMPANIONS.map(|ending| beside(to, ending));
    for present in others.iter().map(PathBuf::as_path).chain([anchor]) {
        if present.exists() {
            std::fs::remove_file(present)?;
        }
    }
    sync_folder(to)?;
    copy.replace(to)
}

/// Gives the backup the owner and the permissions of the old record.
fn like(present: &Path, copy: &Path) {
    #[cfg(unix)]
    if let Ok(about) = std::fs::metadata(present) {
        use std::os::unix::fs::MetadataExt;
        // Only root can change the owner. Otherwise the file keeps its current owner.
        let _ = std::os::unix::fs::chown(copy, Some(about.uid()), Some(about.gid()));
    }
    #[cfg(not(unix))]
    let _ = (present, copy);
}
