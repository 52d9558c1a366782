//! The lock on the record: exclusive ownership by one process, through a lock file and a lock on the database file. The
//! lock file stays while the database file is created or replaced; the second lock holds even if the lock file is deleted.

use super::atomic_file::private;
use super::error::{StoreError, StoreResult};
use super::lost_files::FileId;
use super::record_file_names::path_with_suffix;
use std::ffi::OsStr;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::ErrorKind;
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
        check(path)?;
        let lock = lock_of(path);
        let made = !lock.exists();
        let open = private().create(true).truncate(false).write(true).open(&lock);
        let file = open.map_err(|source| StoreError::Open { path: lock.clone(), source })?;
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

fn lock_of(path: &Path) -> PathBuf {
    path_with_suffix(path, ".lock")
}

/// Whether another process owns the record. Creates nothing.
pub fn is_open_elsewhere(path: &Path) -> bool {
    let is_locked = |file: &Path| {
        // Opening a pipe would wait for its other end.
        file.is_file()
            && File::open(file).is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    };
    is_locked(&lock_of(path)) || (cfg!(unix) && is_locked(path))
}

/// Refuses a path of which no process can take ownership. Creates nothing.
pub(super) fn check(path: &Path) -> StoreResult<()> {
    // `folder/` has a file name for the standard library.
    let ends_with_its_name = |name: &OsStr| path.as_os_str().as_encoded_bytes().ends_with(name.as_encoded_bytes());
    if !path.file_name().is_some_and(ends_with_its_name) {
        return Err(StoreError::NoFileName { path: path.to_owned() });
    }
    refuse_second_name(path)?;
    refuse_unwritable(path)?;
    refuse_unwritable(&lock_of(path))
}

/// Refuses anything at this path but a file that this process can write. Accepts that there is nothing.
pub(super) fn refuse_unwritable(path: &Path) -> StoreResult<()> {
    let opened = match std::fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Ok(found) if !found.is_file() => Err(std::io::Error::other("it is not a file")),
        Ok(_) => OpenOptions::new().write(true).open(path).map(drop),
        Err(error) => Err(error),
    };
    opened.map_err(|source| StoreError::Open { path: path.to_owned(), source })
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
