//! The lock on the record: exclusive ownership by one process, through a lock file and a lock on the database file. The
//! lock file stays while the database file is created or replaced; the second lock holds even if the lock file is deleted.

use super::atomic_file::private;
use super::error::{StoreError, StoreResult};
use super::lost_files::FileId;
use super::record_file_names::path_with_suffix;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// The locks of an open record.
#[derive(Debug)]
pub(super) struct RecordLock {
    lock: PathBuf,
    /// Whether the lock file was created by this process.
    made: bool,
    _lock_file: File,
    /// The locked database file. Closing it while a connection is open would release SQLite's locks.
    database: Option<File>,
}

impl RecordLock {
    /// Takes ownership of an existing or future record.
    pub(super) fn take(path: &Path) -> StoreResult<Self> {
        refuse_second_name(path)?;
        // Resolve links, so that each file has one lock.
        let lock = path_with_suffix(&path.canonicalize().unwrap_or_else(|_| path.to_owned()), ".lock");
        let made = !lock.exists();
        let open = private().create(true).truncate(false).write(true).open(&lock);
        let file = open.map_err(|source| StoreError::Open { path: path.to_owned(), source })?;
        locked(path, &file)?;
        let database = if path.exists() { Some(lock_database(path, false)?) } else { None };
        Ok(Self { lock, made, _lock_file: file, database })
    }

    /// Creates the database file if it is missing, readable by its owner only.
    pub(super) fn make_database(&mut self, path: &Path) -> StoreResult<()> {
        if self.database.is_none() {
            self.database = Some(lock_database(path, true)?);
        }
        Ok(())
    }

    /// Removes the lock file of a path that is not a record.
    pub(super) fn withdraw(self) {
        if self.made {
            let _ = std::fs::remove_file(&self.lock);
        }
    }
}

/// Whether a process owns the record. Creates nothing.
pub fn is_open_elsewhere(path: &Path) -> bool {
    let lock = path_with_suffix(&path.canonicalize().unwrap_or_else(|_| path.to_owned()), ".lock");
    File::open(lock).is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// Refuses a file with hard links, because SQLite's log and our lock file would exist once for each name.
fn refuse_second_name(path: &Path) -> StoreResult<()> {
    #[cfg(unix)]
    if std::fs::metadata(path).is_ok_and(|file| std::os::unix::fs::MetadataExt::nlink(&file) > 1) {
        return Err(StoreError::SeveralNames { path: path.to_owned() });
    }
    Ok(())
}

/// Locks the database file, on systems where locks do not prevent reading.
fn lock_database(path: &Path, create: bool) -> StoreResult<File> {
    let open = private().read(true).write(true).create(create).truncate(false).open(path);
    let file = open.map_err(|source| StoreError::Open { path: path.to_owned(), source })?;
    if cfg!(unix) {
        locked(path, &file)?;
    }
    // The file was replaced in between, by another owner.
    let (opened, there) = (file.metadata(), std::fs::metadata(path));
    if opened.is_ok_and(|opened| there.is_ok_and(|there| FileId::of(&opened) != FileId::of(&there))) {
        return Err(StoreError::InUse { path: path.to_owned() });
    }
    Ok(file)
}

fn locked(path: &Path, file: &File) -> StoreResult<()> {
    match file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(StoreError::InUse { path: path.to_owned() }),
        Err(TryLockError::Error(source)) => Err(StoreError::Open { path: path.to_owned(), source }),
    }
}
