//! `gaitwright export`, `gaitwright import` and `gaitwright signing-key`.

use super::database_file::{exists, note_export};
use super::input_file::read;
use super::out_file::OutFile;
use super::output::data;
use super::settings::{AnchoredFlags, RecordFlags, Settings};
use clap::Args;
use gaitwright_service::error::Error;
use gaitwright_service::studies::archive::{self, PublicKey, SigningKey};
use gaitwright_store::StudyId;
use gaitwright_store::audit::Actor;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct ExportCommand {
    /// Identifier of the study.
    #[arg(value_parser = study)]
    study: StudyId,
    /// New file for the archive.
    #[arg(value_name = "FILE")]
    to: PathBuf,
    #[command(flatten)]
    pub(super) record: RecordFlags,
    /// Key file for signing the archive, made by `gaitwright signing-key`.
    #[arg(long, value_name = "FILE")]
    sign: Option<PathBuf>,
}

fn study(text: &str) -> Result<StudyId, String> {
    text.parse().map_err(|_| "must be the identifier of a study, as in the address of its page".to_owned())
}

impl ExportCommand {
    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        let database = settings.database();
        exists(&database)?;
        let key = self.sign.as_deref().map(|file| SigningKey::read(&read(file)?)).transpose()?;
        let out = OutFile::open_new(&self.to)?;
        let out = archive::export(&database, self.study, out, key).await?;
        note_export(&database, "export", &format!("study {}", self.study), vec![self.study.to_string()]);
        out.finish()?;
        data(&self.to.display().to_string())
    }
}

#[derive(Debug, Args)]
pub(super) struct ImportCommand {
    /// Archive made by `gaitwright export` or downloaded from the service.
    #[arg(value_name = "FILE")]
    from: PathBuf,
    #[command(flatten)]
    pub(super) record: AnchoredFlags,
    /// Public key that must have signed the archive, as printed by `gaitwright signing-key`. If the flag is
    /// repeated, any one of the keys is sufficient.
    #[arg(long, value_name = "KEY")]
    trust: Vec<PublicKey>,
}

impl ImportCommand {
    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        let cannot = |e: std::io::Error| Error::Malformed(format!("Cannot read {}: {e}.", self.from.display()));
        let file = std::fs::File::open(&self.from).map_err(cannot)?;
        // Checked before a database is created.
        let archive = archive::open(file, &self.trust).await?;
        let store = settings.open_record().await?;
        let done = archive::import(&store, &Actor::terminal(), archive).await;
        store.close().await;
        data(&done?.to_string())
    }
}

#[derive(Debug, Args)]
pub(super) struct SigningKeyCommand {
    /// New file for the private key, which only its owner can read.
    #[arg(value_name = "FILE")]
    to: PathBuf,
}

impl SigningKeyCommand {
    pub(super) fn run(self) -> Result<(), Error> {
        let text = SigningKey::generate()?;
        let public = SigningKey::read(&text)?.public();
        let mut out = OutFile::open_new(&self.to)?;
        std::io::Write::write_all(&mut out, text.as_bytes()).map_err(Error::Output)?;
        out.finish()?;
        data(public.as_str())
    }
}
