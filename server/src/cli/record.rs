//! `gaitwright audit` and `gaitwright backup`, `gaitwright restore`: care of the record.

use super::output::{data, tell};
use crate::error::Error;
use crate::store::audit::{self, Verdict};
use crate::store::{Store, StoreError, backup};
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Audit {
    #[command(subcommand)]
    what: AuditCommand,
}

#[derive(Debug, Subcommand)]
enum AuditCommand {
    /// Walk the hash chain of the audit trail; a change of the past is found.
    Verify {
        /// The SQLite file.
        #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
        database: PathBuf,
    },
}

impl Audit {
    pub(super) async fn run(self) -> Result<(), Error> {
        let AuditCommand::Verify { database } = self.what;
        exists(&database)?;
        let pool = backup::open_read_only(&database).await?;
        let verdict = match pool.acquire().await {
            Ok(mut reader) => audit::verify(&mut reader).await,
            Err(error) => Err(StoreError::from(error)),
        };
        pool.close().await;
        match verdict? {
            Verdict::Whole { rows, last } => data(&format!("whole: {rows} rows, last hash {last}")),
            Verdict::Broken { seq } => Err(Error::Internal(format!("the audit trail is broken at row {seq}"))),
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct Backup {
    /// Where the copy goes: a new file.
    to: PathBuf,
    /// The SQLite file; the service may be running.
    #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
    database: PathBuf,
}

impl Backup {
    pub(super) async fn run(self) -> Result<(), Error> {
        exists(&self.database)?;
        if self.to.exists() {
            return Err(Error::conflict(format!("{} exists; choose a new file", self.to.display())));
        }
        backup::of_file(&self.database, &self.to).await?;
        tell("copied and checked");
        data(&self.to.display().to_string())
    }
}

#[derive(Debug, Args)]
pub(super) struct Restore {
    /// A copy made by `gaitwright backup`.
    from: PathBuf,
    /// The SQLite file to put it in place of; the present one is kept beside it.
    #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
    database: PathBuf,
}

impl Restore {
    pub(super) async fn run(self) -> Result<(), Error> {
        exists(&self.from)?;
        backup::check(&self.from).await?;
        let failed = |e: std::io::Error| Error::Internal(e.to_string());
        if self.database.exists() {
            // Owning the file proves that no service runs on it; closing folds its log into it.
            let present = Store::open(&self.database).await?;
            let kept = self.database.with_extension(format!("before-{}", present.stamp()));
            present.close().await;
            std::fs::copy(&self.database, &kept).map_err(failed)?;
            tell(&format!("the present record is kept as {}", kept.display()));
        }
        let part = self.database.with_extension("part");
        std::fs::copy(&self.from, &part).and_then(|_| std::fs::rename(&part, &self.database)).map_err(failed)?;
        tell(&format!("restored {}", self.database.display()));
        Ok(())
    }
}

pub(super) fn exists(path: &Path) -> Result<(), Error> {
    if path.exists() { Ok(()) } else { Err(Error::Malformed(format!("there is no file {}", path.display()))) }
}
