//! `gaitwright audit`.

use super::database_file::exists;
use super::output::data;
use super::settings::{AnchoredFlags, Settings};
use clap::{Args, Subcommand};
use gaitwright_service::error::Error;
use gaitwright_store::verify;

#[derive(Debug, Args)]
pub(super) struct AuditCommand {
    #[command(subcommand)]
    what: AuditSubcommand,
}

#[derive(Debug, Subcommand)]
enum AuditSubcommand {
    /// Verify a record: its file, its schema, its hash chains, the seal of every row, and its anchors. Reports rows
    /// that were changed, added or deleted outside the program.
    Verify {
        #[command(flatten)]
        record: AnchoredFlags,
    },
}

impl AuditCommand {
    pub(super) fn record(&self) -> &AnchoredFlags {
        let AuditSubcommand::Verify { record } = &self.what;
        record
    }

    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        let database = settings.database();
        exists(&database)?;
        let found = verify::file(&database, settings.anchor().as_slice()).await?;
        let (rows, last) = found.audit;
        data(&format!("audit trail intact: {rows} rows, last hash {last}"))?;
        let (seals, last) = found.seals;
        data(&format!("seals intact: {seals} seals, last hash {last}"))?;
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
