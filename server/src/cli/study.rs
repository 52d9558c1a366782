//! `gaitwright export` and `gaitwright import`: a whole study as one file. `gaitwright prune`: retention.

use super::output::data;
use super::record::{exists, note_export};
use crate::compute::OnPool;
use crate::error::Error;
use crate::store::archive::Archive;
use crate::store::audit::{self, Actor};
use crate::store::whole_file::WholeFile;
use crate::store::{Store, StoreError, StudyId, archive, backup, commit, events, gaits, studies};
use crate::studies::belief::Beliefs;
use crate::studies::choice::ranking_to_show;
use crate::studies::recommended;
use crate::studies::standing::Standing;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct Export {
    /// The study.
    study: StudyId,
    /// Where the archive goes: a new file.
    to: PathBuf,
    /// The SQLite file; the service may be running.
    #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
    database: PathBuf,
}

impl Export {
    pub(super) async fn run(self) -> Result<(), Error> {
        exists(&self.database)?;
        let pool = backup::open_read_only(&self.database).await?;
        let packed = match pool.acquire().await {
            Ok(mut reader) => archive::of_study(&mut reader, self.study).await,
            Err(error) => Err(StoreError::from(error)),
        };
        pool.close().await;
        let bytes = packed?;
        note_export(&self.database, "export", &format!("study {}", self.study), vec![self.study.to_string()]);
        let cannot = |e: std::io::Error| Error::Malformed(format!("cannot write {}: {e}", self.to.display()));
        let family = self.to.file_name().unwrap_or_default().to_string_lossy();
        let mut file = WholeFile::begin(&self.to, &family).map_err(cannot)?;
        std::io::Write::write_all(file.file(), &bytes).and_then(|()| file.keep_as(&self.to)).map_err(cannot)?;
        data(&self.to.display().to_string())
    }
}

#[derive(Debug, Args)]
pub(super) struct Import {
    /// An archive made by `gaitwright export`.
    from: PathBuf,
    /// The SQLite file; no service may be running on it.
    #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
    database: PathBuf,
}

impl Import {
    pub(super) async fn run(self) -> Result<(), Error> {
        let file = std::fs::read(&self.from)
            .map_err(|e| Error::Malformed(format!("cannot read {}: {e}", self.from.display())))?;
        // Before a record is made for it.
        let archive = archive::open(&file).map_err(|e| Error::Malformed(e.to_string()))?;
        let store = Store::open(&self.database).await?;
        let done = import(&store, &archive).await;
        store.close().await;
        data(&done?.to_string())
    }
}

/// Writes the study of an archive into a record.
///
/// # Errors
/// [`Error::Conflict`] when the study is there or does not fit.
pub async fn import(store: &Store, archive: &Archive) -> Result<StudyId, Error> {
    let study = archive.study()?;
    let mut writer = store.write().await?;
    match studies::get(&mut writer, study).await {
        Ok(_) => return Err(Error::conflict(format!("study {study} is in this record already"))),
        Err(StoreError::Missing { .. }) => {}
        Err(other) => return Err(other.into()),
    }
    archive::unpack(&mut writer, archive)
        .await
        .map_err(|e| Error::conflict(format!("the archive does not fit this record, nothing was changed: {e}")))?;
    let present = studies::get(&mut writer, study).await?;
    let payload = json!({ "state": present.state, "reason": "imported" });
    events::append(&mut writer, study, "study_changed", &payload).await?;
    let detail = json!({ "name": present.plan.name });
    audit::append(&mut writer, &Actor::terminal(), "study.import", &format!("study {study}"), &detail).await?;
    commit(writer).await?;
    Ok(study)
}

#[derive(Debug, Args)]
pub(super) struct Prune {
    /// Trajectories of studies that ended longer ago than this are dropped; those of gaits that are recommended or may
    /// still be, of what they started from, and of lab sessions are kept.
    #[arg(long, value_name = "DAYS", value_parser = clap::value_parser!(u32).range(1..=36_500))]
    older_than_days: u32,
    /// The SQLite file; no service may be running on it.
    #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
    database: PathBuf,
}

impl Prune {
    pub(super) async fn run(self) -> Result<(), Error> {
        exists(&self.database)?;
        let mut store = Store::open(&self.database).await?;
        let done = prune(&mut store, self.older_than_days).await;
        store.close().await;
        data(&format!("{} trajectories dropped", done?))
    }
}

/// Drops the trajectories of studies that ended so many days ago, but those that are recommended or may still be.
///
/// # Errors
/// What the database or the learner reports.
pub async fn prune(store: &mut Store, days: u32) -> Result<u64, Error> {
    let before = crate::store::now().plus_seconds(-86_400 * i64::from(days));
    let mut dropped = 0;
    let ended = studies::ended_before(&mut *store.read().await?, before).await?;
    for study in ended {
        let id = study.id;
        let standing = Standing::read(&mut *store.read().await?, study).await?;
        let rank = move |pool: &OnPool| ranking_to_show(pool, &standing, &Beliefs::default());
        let ranking = store.compute(rank).await?.map_err(Error::Learner)?;
        let mut writer = store.write().await?;
        let kept = recommended::worth_keeping(&mut writer, &ranking).await?;
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
