//! Background task that backs up the record on a schedule.

use gaitwright_service::error::Error;
use gaitwright_service::supervise::Task;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::{Store, backup, commit};
use serde_json::json;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

/// Delay after a failed backup.
const RETRY: Duration = Duration::from_mins(10);

/// Folder and interval of backups, and how many to keep.
#[derive(Debug, Clone)]
pub(super) struct BackupPlan {
    pub(super) folder: PathBuf,
    pub(super) every: Duration,
    pub(super) keep: usize,
}

impl BackupPlan {
    /// Makes backups as long as the task runs. Failures are logged and retried.
    pub(super) async fn follow(self, store: Store, task: Task) -> Result<(), Error> {
        loop {
            task.works();
            let wait = match self.due_in(&store) {
                Ok(Duration::ZERO) => match self.copy(&store).await {
                    Ok(()) => continue,
                    Err(error) => self.failed(&error),
                },
                Ok(wait) => wait,
                Err(error) => self.failed(&Error::Internal(error.to_string())),
            };
            tokio::time::sleep(wait).await;
        }
    }

    /// Time until the next backup, counted from the newest one, so that a restart neither adds nor skips a backup.
    fn due_in(&self, store: &Store) -> std::io::Result<Duration> {
        let copies = backup::scheduled(store.path(), &self.folder)?;
        let age = |made: SystemTime| SystemTime::now().duration_since(made).unwrap_or_default();
        Ok(copies.first().map_or(Duration::ZERO, |(_, made)| self.every.saturating_sub(age(*made))))
    }

    async fn copy(&self, store: &Store) -> Result<(), Error> {
        let (file, bytes) = backup::into_folder(store, &self.folder, self.keep).await?;
        let mut writer = store.write().await?;
        let (object, detail) = (format!("file {}", file.display()), json!({ "bytes": bytes, "scheduled": true }));
        audit::append(&mut writer, &Actor::program(), "record.backup", &object, &detail).await?;
        commit(writer).await?;
        tracing::info!(file = %file.display(), bytes, "the record was backed up and the backup checked");
        Ok(())
    }

    fn failed(&self, error: &Error) -> Duration {
        tracing::error!(folder = %self.folder.display(), %error, "the record was not backed up; retrying in ten minutes");
        RETRY
    }
}
