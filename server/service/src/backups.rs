//! Backups on request, as jobs.
//!
//! A backup leaves a row in the audit trail when it is requested, and one when it is complete or cancelled. Those that
//! are neither, and are not in progress, failed.

use crate::error::Error;
use crate::job::JobState;
use crate::scheduled_backups::ScheduledBackups;
use gaitwright_store::audit::{self, Actor, AuditRow};
use gaitwright_store::{BackupId, Connection, Instant, Store, Writer, backup, commit};
use serde::Serialize;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;
use utoipa::ToSchema;

const REQUESTED: &str = "backup.request";
const COMPLETE: &str = "backup.complete";
const CANCELLED: &str = "backup.cancel";

/// A complete backup.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Backup {
    /// Identifier.
    pub id: BackupId,
    /// File name, in the folder of the database.
    pub file: String,
    /// Size in bytes.
    pub bytes: u64,
    /// Time of completion.
    pub created_at: Instant,
}

/// The backups that this process makes, and those that it could not make.
#[derive(Debug, Default)]
pub struct Backups {
    progress: Mutex<BTreeMap<BackupId, BackupProgress>>,
    scheduled: Option<Arc<ScheduledBackups>>,
}

#[derive(Debug, Clone)]
enum BackupProgress {
    Running(CancellationToken),
    Failed(String),
}

/// A requested backup, which begins once its request is durable. Dropping it forgets the request.
#[derive(Debug)]
pub struct Requested {
    /// Identifier.
    pub id: BackupId,
    backups: Arc<Backups>,
    cancel: CancellationToken,
    begun: bool,
}

/// A file without its row in the audit trail. Dropping it deletes the file.
struct Unrecorded(Option<PathBuf>);

impl Drop for Unrecorded {
    fn drop(&mut self) {
        if let Some(file) = &self.0
            && let Err(error) = std::fs::remove_file(file)
        {
            tracing::warn!(file = %file.display(), %error, "cannot delete a backup that was not recorded");
        }
    }
}

fn object(id: BackupId) -> String {
    format!("backup {id}")
}

impl Backups {
    /// With the scheduled backups, if there are any.
    pub fn new(scheduled: Option<Arc<ScheduledBackups>>) -> Self {
        Self { scheduled, ..Self::default() }
    }

    /// The scheduled backups, if there are any.
    pub fn scheduled(&self) -> Option<&ScheduledBackups> {
        self.scheduled.as_deref()
    }

    fn table(&self) -> MutexGuard<'_, BTreeMap<BackupId, BackupProgress>> {
        // The table is consistent between statements, so a poisoned lock is usable.
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Requests a backup next to the record.
    ///
    /// # Errors
    /// Too little free space, or an error of the database.
    pub async fn request(
        self: &Arc<Self>,
        store: &Store,
        writer: &mut Writer,
        actor: &Actor,
    ) -> Result<Requested, Error> {
        backup::check_free_space(store)?;
        let id = BackupId::fresh();
        audit::append(writer, actor, REQUESTED, &object(id), &json!({})).await?;
        let cancel = CancellationToken::new();
        self.table().insert(id, BackupProgress::Running(cancel.clone()));
        Ok(Requested { id, backups: Arc::clone(self), cancel, begun: false })
    }

    /// The state of a backup, and the reason if it failed. `None` if it was never requested.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn find(&self, db: &mut Connection, id: BackupId) -> Result<Option<(JobState, Option<String>)>, Error> {
        // Read before the audit trail, because a backup leaves this table after its row is written.
        let progress = self.table().get(&id).cloned();
        let rows = audit::of_object(db, &object(id)).await?;
        let has = |change: &str| rows.iter().any(|row| row.change == change);
        Ok(match progress {
            _ if rows.is_empty() => None,
            _ if has(COMPLETE) => Some((JobState::Done, None)),
            _ if has(CANCELLED) => Some((JobState::Cancelled, None)),
            Some(BackupProgress::Running(_)) => Some((JobState::Running, None)),
            Some(BackupProgress::Failed(reason)) => Some((JobState::Failed, Some(reason))),
            None => Some((JobState::Failed, Some("The service stopped before the backup was complete.".to_owned()))),
        })
    }

    /// The backups in progress.
    pub fn running(&self) -> Vec<BackupId> {
        let table = self.table();
        table.iter().filter(|(_, progress)| matches!(progress, BackupProgress::Running(_))).map(|(id, _)| *id).collect()
    }

    /// Stops a backup whose cancellation is durable.
    pub fn stop(&self, id: BackupId) {
        if let Some(BackupProgress::Running(cancel)) = self.table().get(&id) {
            cancel.cancel();
        }
    }
}

/// A complete backup.
///
/// # Errors
/// [`Error::NotFound`] if there is none; errors of the database.
pub async fn get(db: &mut Connection, id: BackupId) -> Result<Backup, Error> {
    let rows = audit::of_object(db, &object(id)).await?;
    let complete = rows.into_iter().find(|row| row.change == COMPLETE);
    let AuditRow { detail, created_at, .. } =
        complete.ok_or_else(|| Error::NotFound { what: "backup".to_owned(), id: id.to_string() })?;
    let file = detail["file"].as_str().unwrap_or_default().to_owned();
    Ok(Backup { id, file, bytes: detail["bytes"].as_u64().unwrap_or_default(), created_at })
}

/// Records that a backup is cancelled.
///
/// # Errors
/// Errors of the database.
pub async fn cancel(writer: &mut Writer, actor: &Actor, id: BackupId) -> Result<(), Error> {
    Ok(audit::append(writer, actor, CANCELLED, &object(id), &json!({})).await?)
}

impl Requested {
    /// Starts the backup, which finishes even if the caller disconnects.
    pub fn begin(mut self, store: Store, actor: Actor) -> JoinHandle<()> {
        self.begun = true;
        tokio::spawn(async move {
            let made = tokio::select! {
                made = backup::to_record_folder(&store) => made,
                () = self.cancel.cancelled() => {
                    self.backups.table().remove(&self.id);
                    return;
                }
            };
            let recorded = match made {
                Ok((file, bytes)) => self.record(&store, &actor, file, bytes).await,
                Err(error) => Err(error.into()),
            };
            let mut table = self.backups.table();
            table.remove(&self.id);
            if let Err(error) = recorded {
                tracing::warn!(id = %self.id, %error, "a backup failed");
                table.insert(self.id, BackupProgress::Failed(error.to_string()));
            }
        })
    }

    async fn record(&self, store: &Store, actor: &Actor, file: PathBuf, bytes: u64) -> Result<(), Error> {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut unrecorded = Unrecorded(Some(file));
        let mut writer = store.write().await?;
        let object = object(self.id);
        if audit::of_object(&mut writer, &object).await?.iter().any(|row| row.change == CANCELLED) {
            return Ok(());
        }
        audit::append(&mut writer, actor, COMPLETE, &object, &json!({ "file": name, "bytes": bytes })).await?;
        commit(writer).await?;
        unrecorded.0 = None;
        Ok(())
    }
}

impl Drop for Requested {
    fn drop(&mut self) {
        if !self.begun {
            self.backups.table().remove(&self.id);
        }
    }
}
