//! `gaitwright export`, `gaitwright import`, `gaitwright signing-key` and `gaitwright prune`.

use super::database_file::{exists, note_export};
use super::flag_numbers::days;
use super::out_file::OutFile;
use super::output::{data, tell};
use super::problem_flags::read;
use super::settings::{AnchoredFlags, RecordFlags, Settings};
use clap::Args;
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::archive::{self, PublicKey, SigningKey};
use gaitwright_service::studies::belief::Beliefs;
use gaitwright_service::studies::certified_best;
use gaitwright_service::studies::retention::{self, DeletedCounts};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::trial_choice::ranking_to_show;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::{Store, StudyId, commit, gaits, studies};
use serde_json::json;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct Export {
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

impl Export {
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
pub(super) struct Import {
    /// Archive made by `gaitwright export` or downloaded from the service.
    #[arg(value_name = "FILE")]
    from: PathBuf,
    #[command(flatten)]
    pub(super) record: AnchoredFlags,
    /// Public key that the archive's signature must match, as printed by `gaitwright signing-key`; can be repeated.
    #[arg(long, value_name = "KEY")]
    trust: Vec<PublicKey>,
}

impl Import {
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
pub(super) struct NewKey {
    /// New file for the private key, which only its owner can read.
    #[arg(value_name = "FILE")]
    to: PathBuf,
}

impl NewKey {
    pub(super) fn run(self) -> Result<(), Error> {
        let text = SigningKey::generate()?;
        let public = SigningKey::read(&text)?.public();
        let mut out = OutFile::open_new(&self.to)?;
        std::io::Write::write_all(&mut out, text.as_bytes()).map_err(Error::Output)?;
        out.finish()?;
        data(public.as_str())
    }
}

#[derive(Debug, Args)]
pub(super) struct Prune {
    /// Delete the trajectories of gaits in studies that ended more than this many days ago. Keeps the
    /// trajectories of gaits that are or may be recommended, of the gaits that warm-started them, and of gaits in lab
    /// sessions.
    #[arg(long, value_name = "DAYS", value_parser = days, allow_negative_numbers = true)]
    older_than_days: u32,
    #[command(flatten)]
    pub(super) record: AnchoredFlags,
}

impl Prune {
    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        exists(&settings.database())?;
        let mut store = settings.open_record().await?;
        let done = prune(&mut store, self.older_than_days).await;
        let expired = retention::delete_expired(&store).await;
        store.close().await;
        let (DeletedCounts { answers, sessions, links }, trajectories) = (expired?, done?);
        let (keys, sessions) = (count(answers, "idempotency key"), count(sessions, "session"));
        tell(&format!("deleted {keys}, {sessions} and {}", count(links, "sign-in link")));
        data(&format!("trajectories deleted: {trajectories}"))
    }
}

/// How many things expired, as in `2 expired sessions`.
fn count(number: u64, what: &str) -> String {
    format!("{number} expired {what}{}", if number == 1 { "" } else { "s" })
}

/// Deletes the trajectories of studies that ended more than `days` ago, except gaits that are or may be recommended.
///
/// # Errors
/// Errors of the database and the learner.
pub async fn prune(store: &mut Store, days: u32) -> Result<u64, Error> {
    let before = gaitwright_store::now().plus_seconds(-86_400 * i64::from(days));
    let mut dropped = 0;
    let ended = studies::ended_before(&mut *store.read().await?, before).await?;
    for study in ended {
        let id = study.id;
        let snapshot = StudySnapshot::read(&mut *store.read().await?, study).await?;
        let rank = move |pool: &OnPool| ranking_to_show(pool, &snapshot, &Beliefs::default());
        let ranking = store.compute(rank).await?.map_err(Error::Learner)?;
        let mut writer = store.write().await?;
        let kept = certified_best::worth_keeping(&mut writer, &ranking).await?;
        let count = gaits::drop_of_study(&mut writer, id, &kept).await?;
        if count > 0 {
            let detail = json!({ "trajectories": count, "kept": kept });
            audit::append(&mut writer, &Actor::terminal(), "study.prune", &format!("study {id}"), &detail).await?;
            commit(writer).await?;
        }
        dropped += count;
    }
    Ok(dropped)
}
