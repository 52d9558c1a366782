//! `gaitwright backup` and `gaitwright restore`.

use super::database_file::{exists, note_export};
use super::output::{data, tell};
use super::settings::{AnchoredFlags, RecordFlags, Settings};
use clap::Args;
use gaitwright_service::error::Error;
use gaitwright_store::{backup, restore};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct BackupCommand {
    /// New file for the backup.
    #[arg(value_name = "FILE")]
    to: PathBuf,
    #[command(flatten)]
    pub(super) record: RecordFlags,
}

impl BackupCommand {
    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        let database = settings.database();
        exists(&database)?;
        if self.to.exists() {
            return Err(Error::conflict(format!("{} already exists. Choose a new file.", self.to.display())));
        }
        backup::of_file(&database, &self.to).await?;
        note_export(&database, "backup", "the whole record", Vec::new());
        tell("backup written and verified");
        data(&self.to.display().to_string())
    }
}

#[derive(Debug, Args)]
pub(super) struct RestoreCommand {
    /// Backup made by `gaitwright backup` or by the service.
    #[arg(value_name = "FILE")]
    from: PathBuf,
    #[command(flatten)]
    pub(super) record: AnchoredFlags,
}

impl RestoreCommand {
    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        let database = settings.database();
        exists(&self.from)?;
        if let Some(kept) = restore::from_file(&self.from, &database, settings.anchor().as_deref()).await? {
            tell(&format!("the replaced record is kept as {}", kept.display()));
        }
        tell(&format!("restored {}", database.display()));
        Ok(())
    }
}
