//! Scheduled backups of the record: the task that makes them, and whether the last attempt failed.

use crate::error::Error;
use crate::supervise::Task;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::backup_folder::BackupFolder;
use gaitwright_store::{Instant, Store, commit, now};
use serde_json::json;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

/// Delay after a failed backup.
const RETRY_PAUSE: Duration = Duration::from_mins(10);

/// Folder and interval of backups, and how many to keep.
#[derive(Debug, Clone)]
pub struct BackupPlan {
    /// Folder of the backups.
    pub folder: PathBuf,
    /// Time between two backups.
    pub every: Duration,
    /// Number of backups to keep.
    pub keep: usize,
}

/// A plan whose folder this process has claimed.
#[derive(Debug, Clone)]
pub struct ClaimedPlan {
    backups: Arc<ScheduledBackups>,
    every: Duration,
    keep: usize,
}

impl BackupPlan {
    /// Claims the folder for the backups of a record.
    ///
    /// # Errors
    /// If the folder cannot be claimed.
    pub fn claim(self, store: &Store) -> Result<ClaimedPlan, Error> {
        let backups = Arc::new(ScheduledBackups::new(BackupFolder::claim(store, &self.folder)?));
        Ok(ClaimedPlan { backups, every: self.every, keep: self.keep })
    }
}

impl ClaimedPlan {
    /// The backups in the claimed folder.
    pub fn backups(&self) -> Arc<ScheduledBackups> {
        Arc::clone(&self.backups)
    }

    /// Makes backups as long as the task runs. Failures are logged, shown and retried.
    ///
    /// # Errors
    /// Never: it runs until the task is dropped.
    pub async fn follow(self, store: Store, task: Task) -> Result<(), Error> {
        loop {
            task.works();
            let wait = match self.due_in() {
                Ok(Duration::ZERO) => match self.copy(&store).await {
                    Ok(()) => {
                        self.backups.succeeded();
                        continue;
                    }
                    Err(error) => self.failed(&error),
                },
                Ok(wait) => wait,
                Err(error) => self.failed(&Error::Internal(error.to_string())),
            };
            tokio::time::sleep(wait).await;
        }
    }

    /// Time until the next backup, counted from the newest one, so that a restart neither adds nor skips a backup. A file
    /// with a time in the future does not count: it could keep backups from being made.
    fn due_in(&self) -> std::io::Result<Duration> {
        let copies = self.backups.folder().backups()?;
        let age = copies.iter().find_map(|(_, made)| SystemTime::now().duration_since(*made).ok());
        Ok(age.map_or(Duration::ZERO, |age| self.every.saturating_sub(age)))
    }

    async fn copy(&self, store: &Store) -> Result<(), Error> {
        let (file, bytes) = self.backups.folder().add(store, self.keep).await?;
        let mut writer = store.write().await?;
        let (object, detail) = (format!("file {}", file.display()), json!({ "bytes": bytes, "scheduled": true }));
        audit::append(&mut writer, &Actor::program(), "record.backup", &object, &detail).await?;
        commit(writer).await?;
        tracing::info!(file = %file.display(), bytes, "the record was backed up and the backup verified");
        Ok(())
    }

    fn failed(&self, error: &Error) -> Duration {
        tracing::error!(folder = %self.backups.folder().path().display(), %error, "the record was not backed up; retrying in ten minutes");
        self.backups.failed(error.to_string());
        RETRY_PAUSE
    }
}

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
