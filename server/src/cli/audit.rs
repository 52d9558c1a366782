//! `gaitwright audit`.

use super::database_file::exists;
use super::output::data;
use clap::{Args, Subcommand};
use gaitwright_service::error::Error;
use gaitwright_store::verify;
use std::path::PathBuf;

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
