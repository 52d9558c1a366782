//! `gaitwright backup` and `gaitwright restore`.

use super::database_file::{exists, note_export};
use super::output::{data, tell};
use clap::Args;
use gaitwright_service::error::Error;
use gaitwright_store::{backup, restore};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct Backup {
    /// New file for the backup.
    to: PathBuf,
    /// SQLite file; the service may be running.
    #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
    database: PathBuf,
}

impl Backup {
    pub(super) async fn run(self) -> Result<(), Error> {
        exists(&self.database)?;
        if self.to.exists() {
            return Err(Error::conflict(format!("{} already exists. Choose a new file.", self.to.display())));
        }
        backup::of_file(&self.database, &self.to).await?;
        note_export(&self.database, "backup", "the whole record", Vec::new());
        tell("backup written and verified");
        data(&self.to.display().to_string())
    }
}

#[derive(Debug, Args)]
pub(super) struct Restore {
    /// Backup made by `gaitwright backup`.
    from: PathBuf,
    /// SQLite file to replace; the current one is kept next to it.
    #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
    database: PathBuf,
    /// Second anchor file of the service, which is updated to match the backup.
    #[arg(long, env = "GAITWRIGHT_ANCHOR", value_name = "FILE")]
    anchor: Option<PathBuf>,
}

impl Restore {
    pub(super) async fn run(self) -> Result<(), Error> {
        exists(&self.from)?;
        if let Some(kept) = restore::from_file(&self.from, &self.database, self.anchor.as_deref()).await? {
            tell(&format!("the current database is kept as {}", kept.display()));
        }
        tell(&format!("restored {}", self.database.display()));
        Ok(())
    }
}
