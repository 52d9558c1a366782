//! `gaitwright audit`, `gaitwright backup` and `gaitwright restore`.

use super::output::{data, tell};
use clap::{Args, Subcommand};
use gaitwright_service::error::Error;
use gaitwright_store::access_log::{Access, Kind};
use gaitwright_store::audit::Actor;
use gaitwright_store::{access_spool, backup, restore, verify};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Audit {
    #[command(subcommand)]
    what: AuditCommand,
}

#[derive(Debug, Subcommand)]
enum AuditCommand {
    /// Verify a database: its file, its schema, its hash chains, the seal of every row, and its anchors. Reports rows
    /// that were changed, added or deleted outside the program.
    Verify {
        /// SQLite file.
        #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
        database: PathBuf,
        /// Second anchor file of the service, besides the one next to the database.
        #[arg(long, env = "GAITWRIGHT_ANCHOR", value_name = "FILE")]
        anchor: Option<PathBuf>,
    },
}

impl Audit {
    pub(super) async fn run(self) -> Result<(), Error> {
        let AuditCommand::Verify { database, anchor } = self.what;
        exists(&database)?;
        let found = verify::file(&database, anchor.as_slice()).await?;
        let (rows, last) = found.audit;
        data(&format!("audit trail intact: {rows} rows, last hash {last}"))?;
        data(&match found.seals {
            Some((seals, last)) => format!("seals intact: {seals} seals, last hash {last}"),
            None => {
                "no seals: an older version wrote this record; the next start of the service will seal it".to_owned()
            }
        })?;
        for (anchor, ends) in &found.anchors {
            let (audit, seals) = (ends.audit.seq, ends.seals.seq);
            data(&format!("complete according to anchor {}: {audit} rows, {seals} seals", anchor.display()))?;
        }
        if found.anchors.is_empty() {
            data("no anchor: rows missing at the end cannot be detected")?;
        }
        Ok(())
    }
}

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
        tell("backup written and checked");
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
    /// Second anchor file of the service, which is updated to the backup.
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

/// Notes for the access log that data of subjects leaves the record. Prints a warning if nothing can be written next to
/// the record, as on a read-only medium.
pub(super) fn note_export(database: &Path, command: &str, object: &str, named: Vec<String>) {
    let access = Access {
        kind: Kind::Export,
        actor: Actor::terminal().as_str().to_owned(),
        address: String::new(),
        method: String::new(),
        route: format!("gaitwright {command}"),
        object: object.to_owned(),
        status: 0,
        named,
    };
    if let Err(error) = access_spool::note(database, &access) {
        tell(&format!("gaitwright: cannot note this {command} for the access log: {error}"));
    }
}

pub(super) fn exists(path: &Path) -> Result<(), Error> {
    if path.exists() { Ok(()) } else { Err(Error::Malformed(format!("There is no file {}.", path.display()))) }
}
