//! `gaitwright audit` and `gaitwright backup`, `gaitwright restore`: care of the record.

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
    /// Check the database file, walk the hash chains, compare every row with its seal or checksum, and the record with its
    /// anchors: a change of the past is found, and an end that is missing.
    Verify {
        /// The SQLite file.
        #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
        database: PathBuf,
        /// The anchor that the service keeps elsewhere, besides the one beside the record.
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
        data(&format!("whole: {rows} rows, last hash {last}"))?;
        data(&match found.seals {
            Some((seals, last)) => format!("whole: {seals} seals, last hash {last}"),
            None => "no seals: an older version wrote this record; it is sealed when it is next opened".to_owned(),
        })?;
        for (anchor, ends) in &found.anchors {
            let (audit, seals) = (ends.audit.seq, ends.seals.seq);
            data(&format!("nothing is missing that {} has seen: {audit} rows, {seals} seals", anchor.display()))?;
        }
        if found.anchors.is_empty() {
            data("no anchor: rows that are missing at the end cannot be seen")?;
        }
        Ok(())
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
        note_export(&self.database, "backup", "the whole record", Vec::new());
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
    /// The anchor that the service keeps elsewhere; it then holds what the copy ends with.
    #[arg(long, env = "GAITWRIGHT_ANCHOR", value_name = "FILE")]
    anchor: Option<PathBuf>,
}

impl Restore {
    pub(super) async fn run(self) -> Result<(), Error> {
        exists(&self.from)?;
        if let Some(kept) = restore::from_file(&self.from, &self.database, self.anchor.as_deref()).await? {
            tell(&format!("the present record is kept as {}", kept.display()));
        }
        tell(&format!("restored {}", self.database.display()));
        Ok(())
    }
}

/// Notes for the access log that data of subjects leaves the record. Where nothing can be written beside the record, as on a
/// read-only medium, a warning stays.
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
        tell(&format!("gaitwright: the access log does not hear of this {command}: {error}"));
    }
}

pub(super) fn exists(path: &Path) -> Result<(), Error> {
    if path.exists() { Ok(()) } else { Err(Error::Malformed(format!("there is no file {}", path.display()))) }
}
