//! The scheduled backups of this process: their folder, and whether the last attempt failed.

use gaitwright_store::backup_folder::BackupFolder;
use gaitwright_store::{Instant, now};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The scheduled backups of this process.
#[derive(Debug)]
pub struct ScheduledBackups {
    folder: BackupFolder,
    failure: Mutex<Option<Failure>>,
}

/// Failed attempts since the last success.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// Time of the first.
    pub since: Instant,
    /// Reason of the last.
    pub reason: String,
}

impl ScheduledBackups {
    /// In a claimed folder. No attempt has failed yet.
    pub fn new(folder: BackupFolder) -> Self {
        Self { folder, failure: Mutex::new(None) }
    }

    /// The claimed folder.
    pub fn folder(&self) -> &BackupFolder {
        &self.folder
    }

    /// The failure, if the last attempt failed.
    pub fn failure(&self) -> Option<Failure> {
        self.state().clone()
    }

    /// Notes that an attempt succeeded.
    pub fn succeeded(&self) {
        *self.state() = None;
    }

    /// Notes that an attempt failed.
    pub fn failed(&self, reason: String) {
        let mut state = self.state();
        let since = state.as_ref().map_or_else(now, |earlier| earlier.since);
        *state = Some(Failure { since, reason });
    }

    fn state(&self) -> MutexGuard<'_, Option<Failure>> {
        // A failure is replaced as a whole, so a poisoned lock is usable.
        self.failure.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
