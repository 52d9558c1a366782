//! The folder of scheduled backups. It belongs to one record, because the oldest backups in it are removed.

use super::atomic_file::private;
use super::record_file_names::free_name;
use super::record_file_names::path_with_suffix;
use super::{Store, StoreError, StoreResult, backup};
use std::fs::{File, TryLockError};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Prefix of the names of scheduled backups.
const SCHEDULED: &str = "scheduled";
/// Longest path in a claim, bytes.
const MAX_PATH: u64 = 1 << 16;

/// A folder that this process has claimed for the backups of a record.
#[derive(Debug)]
pub struct BackupFolder {
    folder: PathBuf,
    /// The path of the folder and the name of the record.
    stem: PathBuf,
    /// Locked while this process lives.
    _claim: File,
}

impl BackupFolder {
    /// Claims a folder for the backups of an open record. The claim is a file with the path of the record
    /// (`gaitwright.db.owner`). It stays, so that two services that run in turn do not remove each other's backups.
    ///
    /// # Errors
    /// [`StoreError::FolderOfOther`]; a folder in which no file can be written.
    pub fn claim(store: &Store, folder: &Path) -> StoreResult<Self> {
        let record = store.path();
        let (stem, claim) = Self::names(record, folder);
        let cannot = |source| StoreError::Open { path: claim.clone(), source };
        let own = record.canonicalize().map_err(cannot)?;
        let own = own.to_string_lossy();
        let open = private().create(true).truncate(false).read(true).write(true).open(&claim);
        let mut file = open.map_err(cannot)?;
        let is_locked = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
        let mut owner = String::new();
        (&file).take(MAX_PATH).read_to_string(&mut owner).map_err(cannot)?;
        if is_locked || !(owner.is_empty() || owner.trim_end() == own) {
            let (folder, record) = (folder.to_owned(), owner.trim_end().to_owned());
            return Err(StoreError::FolderOfOther { folder, record, claim });
        }
        if owner.is_empty() {
            file.write_all(format!("{own}\n").as_bytes()).and_then(|()| file.sync_all()).map_err(cannot)?;
        }
        let whole = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        Ok(Self { folder: whole, stem, _claim: file })
    }

    /// Refuses a folder that another record claimed. Creates nothing.
    ///
    /// # Errors
    /// [`StoreError::FolderOfOther`], [`StoreError::Open`].
    pub fn check(record: &Path, folder: &Path) -> StoreResult<()> {
        let (_, claim) = Self::names(record, folder);
        let cannot = |source| StoreError::Open { path: claim.clone(), source };
        let mut owner = String::new();
        match File::open(&claim) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            file => file.and_then(|file| file.take(MAX_PATH).read_to_string(&mut owner)).map_err(cannot)?,
        };
        let own = record.canonicalize().unwrap_or_else(|_| record.to_owned());
        if owner.is_empty() || owner.trim_end() == own.to_string_lossy() {
            return Ok(());
        }
        Err(StoreError::FolderOfOther { folder: folder.to_owned(), record: owner.trim_end().to_owned(), claim })
    }

    /// The stem of the backups, and the file that names the owner.
    fn names(record: &Path, folder: &Path) -> (PathBuf, PathBuf) {
        let stem = folder.join(record.file_name().unwrap_or_default());
        let claim = path_with_suffix(&stem, ".owner");
        (stem, claim)
    }

    /// The path of the folder.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Writes a backup (`gaitwright.db.scheduled-20260501T101500`), verifies it, and removes the oldest ones beyond
    /// `keep`. Returns the new file and its size.
    ///
    /// # Errors
    /// As [`backup::of_store`], [`StoreError::NearlyFull`], and when an old backup cannot be removed.
    pub async fn add(&self, store: &Store, keep: usize) -> StoreResult<(PathBuf, u64)> {
        let _turn = store.copying.lock().await;
        let to = free_name(&self.stem, SCHEDULED);
        store.room_for_copy(&to)?;
        backup::of_store(store, &to).await?;
        let cannot = |source| StoreError::Open { path: self.folder.clone(), source };
        let size = std::fs::metadata(&to).map_err(cannot)?.len();
        // Only now, so that the newest backup that remains is one that was verified.
        // The new one stays, whatever times the others have.
        let others = self.backups().map_err(cannot)?.into_iter().filter(|(path, _)| path.file_name() != to.file_name());
        for (old, _) in others.skip(keep.saturating_sub(1)) {
            std::fs::remove_file(&old).map_err(|source| StoreError::Open { path: old, source })?;
        }
        Ok((to, size))
    }

    /// The backups in the folder, newest first: name and bytes.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn sizes(&self) -> std::io::Result<Vec<(String, i64)>> {
        let size_of = |(path, _): (PathBuf, SystemTime)| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            Ok((name, i64::try_from(std::fs::metadata(&path)?.len()).unwrap_or(i64::MAX)))
        };
        self.backups()?.into_iter().map(size_of).collect()
    }

    /// The backups in the folder, newest first, with their times.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn backups(&self) -> std::io::Result<Vec<(PathBuf, SystemTime)>> {
        let start = format!("{}.{SCHEDULED}-", self.stem.file_name().unwrap_or_default().to_string_lossy());
        let mut found = Vec::new();
        for entry in std::fs::read_dir(&self.folder)? {
            let entry = entry?;
            // Not a folder or a link, which no backup made.
            if entry.file_name().to_string_lossy().starts_with(&start) && entry.file_type()?.is_file() {
                found.push((entry.metadata()?.modified()?, entry.path()));
            }
        }
        found.sort();
        Ok(found.into_iter().rev().map(|(made, path)| (path, made)).collect())
    }
}
