//! Deletes trajectories of gaits that nobody needs any more.

use super::analysis::Analyses;
use super::certified_best;
use super::recommended_trial::ranking_to_show;
use super::snapshot::StudySnapshot;
use crate::error::Error;
use gaitwright_compute::OnPool;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::{Store, commit, gaits, now, other_local_optima, studies};
use serde_json::json;

/// Deletes the trajectories of studies that ended more than `days` ago, except gaits that are or may be recommended.
///
/// # Errors
/// Errors of the database and the learner.
pub async fn prune(store: &mut Store, days: u32) -> Result<u64, Error> {
    let before = now().plus_seconds(-86_400 * i64::from(days));
    let mut dropped = 0;
    let ended = studies::ended_before(&mut *store.read().await?, before).await?;
    for study in ended {
        let id = study.id;
        let snapshot = StudySnapshot::read(&mut *store.read().await?, study).await?;
        let rank = move |pool: &OnPool| ranking_to_show(pool, &snapshot, &Analyses::default());
        let ranking = store.compute(rank).await?.map_err(Error::Learner)?;
        let mut writer = store.write().await?;
        let kept = certified_best::worth_keeping(&mut writer, &ranking).await?;
        let count = gaits::drop_of_study(&mut writer, id, &kept).await?;
        if count > 0 {
            other_local_optima::drop_without_gait(&mut writer, id).await?;
            let detail = json!({ "trajectories": count, "kept": kept });
            audit::append(&mut writer, &Actor::terminal(), "study.prune", &format!("study {id}"), &detail).await?;
            commit(writer).await?;
        }
        dropped += count;
    }
    Ok(dropped)
}
