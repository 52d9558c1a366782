//! `gaitwright audit` and `gaitwright backup`, `gaitwright restore`: care of the record.

use super::output::{data, tell};
use crate::error::Error;
use crate::store::access_log::{Access, Kind};
use crate::store::audit::Actor;
use crate::store::{Connection, StoreError, access_spool, audit, backup, restore, seals};
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Audit {
    #[command(subcommand)]
    what: AuditCommand,
}

#[derive(Debug, Subcommand)]
enum AuditCommand {
    /// Walk the hash chain of the audit trail and compare every row with its seal; a change of the past is found.
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
        let found = match pool.acquire().await {
            Ok(mut reader) => verify(&mut reader).await,
            Err(error) => Err(StoreError::from(error).into()),
        };
        pool.close().await;
        data(&found?)
    }
}

/// What is to be said of a whole record.
async fn verify(db: &mut Connection) -> Result<String, Error> {
    let broken = |reason| Error::Store(StoreError::Damaged { what: "evidence", reason });
    let trail = match audit::verify(db).await? {
        audit::Verdict::Whole { rows, last } => format!("whole: {rows} rows, last hash {last}"),
        audit::Verdict::Broken { seq } => return Err(broken(format!("the audit trail is broken at row {seq}"))),
    };
    match seals::verify(db).await? {
        seals::Verdict::Whole { seals, last } => Ok(format!("{trail}\nwhole: {seals} seals, last hash {last}")),
        seals::Verdict::None => {
            Ok(format!("{trail}\nno seals: an older version wrote this record; it is sealed when it is next opened"))
        }
        seals::Verdict::Broken { seq } => Err(broken(format!("the seals are broken at number {seq}"))),
        seals::Verdict::Touched { table, key } => {
            Err(broken(format!("row {key} of {table} is not as this program wrote it")))
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
}

impl Restore {
    pub(super) async fn run(self) -> Result<(), Error> {
        exists(&self.from)?;
        if let Some(kept) = restore::from_file(&self.from, &self.database).await? {
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
