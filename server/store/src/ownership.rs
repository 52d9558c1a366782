//! One process owns a record. It holds a lock on a file beside it and one on the database file itself: the first lasts
//! while the database file is put in place or replaced, the second whatever becomes of the first.

use super::files::FileId;
use super::whole_file::private;
use super::{StoreError, StoreResult, beside};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// Held as long as the record is.
#[derive(Debug)]
pub(super) struct Ownership {
    lock: PathBuf,
    /// The file beside it was made for this.
    made: bool,
    _beside: File,
    /// Never closed while a connection is open: closing it takes away the locks that SQLite has on the file.
    database: Option<File>,
}

impl Ownership {
    /// Of a record that is there, or of the place for one.
    pub(super) fn take(path: &Path) -> StoreResult<Self> {
        refuse_second_name(path)?;
        // One file has one lock, whatever link it is opened through.
        let lock = beside(&path.canonicalize().unwrap_or_else(|_| path.to_owned()), ".lock");
        let made = !lock.exists();
        let open = private().create(true).truncate(false).write(true).open(&lock);
        let file = open.map_err(|source| StoreError::Open { path: path.to_owned(), source })?;
        locked(path, &file)?;
        let database = if path.exists() { Some(lock_database(path, false)?) } else { None };
        Ok(Self { lock, made, _beside: file, database })
    }

    /// Makes the database file where there is none, for its owner alone.
    pub(super) fn make_database(&mut self, path: &Path) -> StoreResult<()> {
        if self.database.is_none() {
            self.database = Some(lock_database(path, true)?);
        }
        Ok(())
    }

    /// Leaves nothing beside a file that is no record.
    pub(super) fn withdraw(self) {
        if self.made {
            let _ = std::fs::remove_file(&self.lock);
        }
    }
}

/// SQLite finds its log by the name of the file, and so is our lock found: a file with two names has two of each.
fn refuse_second_name(path: &Path) -> StoreResult<()> {
    #[cfg(unix)]
    if std::fs::metadata(path).is_ok_and(|file| std::os::unix::fs::MetadataExt::nlink(&file) > 1) {
        return Err(StoreError::SeveralNames { path: path.to_owned() });
    }
    Ok(())
}

/// The database file, locked where a lock does not keep others from reading it.
fn lock_database(path: &Path, create: bool) -> StoreResult<File> {
    let open = private().read(true).write(true).create(create).truncate(false).open(path);
    let file = open.map_err(|source| StoreError::Open { path: path.to_owned(), source })?;
    if cfg!(unix) {
        locked(path, &file)?;
    }
    // Put in place between the two: whoever did that owns it.
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
