//! Detects that files of the open record were deleted, replaced or truncated. SQLite would keep writing to a deleted
//! file, and all acknowledged changes would be lost with the process.

use super::error::{StoreError, StoreResult};
use super::record_file_names::path_with_suffix;
use super::wal_check::Log;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// The identity of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FileId(u64, u64);

impl FileId {
    #[cfg(unix)]
    pub(super) fn of(file: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        Self(file.dev(), file.ino())
    }

    #[cfg(not(unix))]
    pub(super) fn of(_: &Metadata) -> Self {
        // On these systems an open file cannot be deleted or replaced.
        Self(0, 0)
    }
}

/// A file and its last known state.
#[derive(Debug)]
struct TrackedFile {
    what: &'static str,
    path: PathBuf,
    id: FileId,
    /// The known length. SQLite never shortens the file or its log while the record is open. `None` if it may.
    bytes: Option<u64>,
}

/// The files of an open record.
#[derive(Debug)]
pub(super) struct RecordFiles {
    path: PathBuf,
    seen: Mutex<Vec<TrackedFile>>,
    log: Mutex<Log>,
    /// The first problem found. It is permanent, because a file that appears later is a different one.
    problem: OnceLock<String>,
    /// Whether saving the content of the log was attempted.
    saved: OnceLock<()>,
}

impl RecordFiles {
    /// The database file of an open connection, and SQLite's companion files.
    pub(super) fn of(path: &Path) -> StoreResult<Self> {
        let files =
            [("the database file", ""), ("its write-ahead log (-wal)", "-wal"), ("its shared memory (-shm)", "-shm")];
        let mut seen = Vec::new();
        for (what, ending) in files {
            let path = path_with_suffix(path, ending);
            let file = std::fs::metadata(&path).map_err(|source| StoreError::Open { path: path.clone(), source })?;
            let bytes = (ending != "-shm").then_some(file.len());
            seen.push(TrackedFile { what, path, id: FileId::of(&file), bytes });
        }
        let name = path_with_suffix(path, "-wal");
        let log = Log::open(&name).map_err(|source| StoreError::Open { path: name, source })?;
        Ok(Self {
            path: path.to_owned(),
            seen: Mutex::new(seen),
            log: Mutex::new(log),
            problem: OnceLock::new(),
            saved: OnceLock::new(),
        })
    }

    /// Returns an error if any file was ever found to be deleted, replaced or truncated.
    pub(super) fn check(&self) -> StoreResult<()> {
        if let Some(what) = self.problem.get() {
            return Err(self.vanished(what));
        }
        let found = self.seen.lock().unwrap_or_else(PoisonError::into_inner).iter_mut().find_map(TrackedFile::look);
        found.map_or(Ok(()), |found| Err(self.refuse(found)))
    }

    /// [`Self::check`], and verifies the log up to the given number of frames.
    pub(super) fn check_log(&self, frames: u32) -> StoreResult<()> {
        self.check()?;
        match self.log().is_whole(frames) {
            Ok(true) => Ok(()),
            Ok(false) => Err(self.refuse("its write-ahead log (-wal) was truncated during a change".to_owned())),
            Err(error) => Err(self.refuse(format!("its write-ahead log (-wal) could not be read back ({error})"))),
        }
    }

    /// Refuses all further changes, because another program wrote to the record.
    pub(super) fn refuse_second_writer(&self) -> StoreError {
        self.refuse("another program wrote to it".to_owned())
    }

    fn log(&self) -> MutexGuard<'_, Log> {
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn refuse(&self, found: String) -> StoreError {
        let refusal = self.vanished(self.problem.get_or_init(|| found));
        tracing::error!("{refusal}");
        refusal
    }

    /// Whether the database file is intact, so that the content of a deleted log can be saved to it. True only once.
    /// The log has the given number of frames.
    pub(super) fn log_is_to_be_saved(&self, frames: u32) -> bool {
        if self.saved.set(()).is_err() || !self.log().is_whole(frames).is_ok_and(|whole| whole) {
            return false;
        }
        let seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        let is_there =
            |seen: &TrackedFile| std::fs::metadata(&seen.path).is_ok_and(|file| FileId::of(&file) == seen.id);
        let was_cut = |seen: &TrackedFile| std::fs::metadata(&seen.path).is_ok_and(|file| seen.is_cut(&file));
        seen.first().is_some_and(is_there) && !seen.iter().any(was_cut)
    }

    fn vanished(&self, what: &str) -> StoreError {
        StoreError::RecordVanished { path: self.path.clone(), what: what.to_owned() }
    }
}

impl TrackedFile {
    /// The loss of the file, in words; `None` if it is intact.
    fn look(&mut self) -> Option<String> {
        let what = self.what;
        match std::fs::metadata(&self.path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Some(format!("{what} was deleted")),
            Err(error) => Some(format!("{what} could not be reached ({error})")),
            Ok(file) if FileId::of(&file) != self.id => Some(format!("{what} was replaced")),
            Ok(file) if self.is_cut(&file) => Some(format!("{what} was truncated to {} bytes", file.len())),
            Ok(file) => {
                self.bytes = self.bytes.map(|_| file.len());
                None
            }
        }
    }

    fn is_cut(&self, file: &Metadata) -> bool {
        FileId::of(file) == self.id && self.bytes.is_some_and(|bytes| file.len() < bytes)
    }
}
