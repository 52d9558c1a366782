//! The access spool: a file next to the record in which commands note exports, until the owner of the record writes
//! them to the access log.

use super::access_log::{Access, Tally};
use super::{Instant, StoreError, StoreResult, beside};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// Number of bytes of the spool that are read at a time.
const LONGEST_BYTES: u64 = 1 << 20;

#[derive(Serialize, Deserialize)]
struct Line {
    at: Instant,
    access: Access,
}

fn path_of(record: &Path) -> PathBuf {
    beside(record, ".access")
}

/// Notes an access durably.
///
/// # Errors
/// If the file cannot be written, as on a read-only medium.
pub fn note(record: &Path, access: &Access) -> StoreResult<()> {
    let path = path_of(record);
    let failed = |source| StoreError::Open { path: path.clone(), source };
    let line = Line { at: super::now(), access: access.clone() };
    let mut text = super::json::to_text("access", &line)?;
    text.push('\n');
    let mut options = OpenOptions::new();
    options.create(true).append(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(&path).map_err(failed)?;
    file.lock().and_then(|()| file.write_all(text.as_bytes())).and_then(|()| file.sync_all()).map_err(failed)
}

/// The noted accesses. While this is held, no command can add any.
#[derive(Debug)]
pub struct Spool {
    file: File,
    path: PathBuf,
    /// The accesses, oldest first.
    pub noted: Vec<(Access, Tally)>,
}

/// Takes the accesses that were noted next to a record, if any.
///
/// # Errors
/// If the file cannot be read.
pub fn take(record: &Path) -> StoreResult<Option<Spool>> {
    let path = path_of(record);
    if !std::fs::metadata(&path).is_ok_and(|file| file.len() > 0) {
        return Ok(None);
    }
    let failed = |source| StoreError::Open { path: path.clone(), source };
    let file = OpenOptions::new().read(true).write(true).open(&path).map_err(failed)?;
    match file.try_lock() {
        Ok(()) => {}
        // A command is writing, so take it next time.
        Err(TryLockError::WouldBlock) => return Ok(None),
        Err(TryLockError::Error(source)) => return Err(failed(source)),
    }
    let mut text = String::new();
    (&file).take(LONGEST_BYTES).read_to_string(&mut text).map_err(failed)?;
    let noted = text.lines().filter_map(|line| {
        let Ok(Line { at, access }) = serde_json::from_str(line) else {
            tracing::warn!(file = %path.display(), "ignoring a malformed line of the access spool");
            return None;
        };
        Some((access, Tally { first_at: at, last_at: at, times: 1 }))
    });
    let noted = noted.collect();
    Ok(Some(Spool { file, path, noted }))
}

impl Spool {
    /// Clears the spool after its accesses were written to the log.
    ///
    /// # Errors
    /// If the file cannot be cleared.
    pub fn clear(self) -> StoreResult<()> {
        self.file.set_len(0).map_err(|source| StoreError::Open { path: self.path, source })
    }
}
