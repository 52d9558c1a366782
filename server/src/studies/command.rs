//! What a person does to a study or a trial: start, pause, resume, stop, extend; cancel, retry.

use super::director::Director;
use super::lifecycle::{self, Act};
use super::record;
use crate::error::Error;
use crate::store::studies::Study;
use crate::store::trials::Trial;
use crate::store::{StudyId, TrialId, commit, events, studies, trials};
use serde_json::json;

/// Does it, if it is possible where the study stands.
///
/// # Errors
/// [`Error::NotFound`], or [`Error::Conflict`] with what is possible instead.
pub async fn act(director: &Director, id: StudyId, act: Act, reason: &str) -> Result<Study, Error> {
    let mut writer = director.store().write().await?;
    let study = studies::get(&mut writer, id).await?;
    let state = lifecycle::after(study.state, act)?;
    if !studies::set_state(&mut writer, &study, state, reason).await? {
        return Err(Error::conflict("the study changed at the same moment; try again"));
    }
    events::append(&mut writer, id, "study_changed", &json!({ "state": state, "reason": reason })).await?;
    let changed = studies::get(&mut writer, id).await?;
    let open = trials::of_study(&mut writer, id).await?.into_iter().filter(|trial| trial.state.is_open());
    let open: Vec<TrialId> = open.map(|trial| trial.id).collect();
    commit(writer).await?;
    if act == Act::Stop {
        for trial in open {
            match cancel(director, trial, "the study was stopped").await {
                // It ended by itself a moment before.
                Ok(_) | Err(Error::Conflict(_)) => {}
                Err(error) => return Err(error),
            }
        }
    }
    director.changed();
    Ok(changed)
}

/// Ends an open trial; its solve stops within one iteration.
///
/// # Errors
/// [`Error::NotFound`], or [`Error::Conflict`] when it has ended.
pub async fn cancel(director: &Director, id: TrialId, reason: &str) -> Result<Trial, Error> {
    record::cancelled(director.store(), id, reason).await?;
    director.cancel_solve(id);
    director.changed();
    Ok(trials::get(&mut *director.store().read().await?, id).await?)
}

/// Lets a trial that gave no result run once more.
///
/// # Errors
/// [`Error::NotFound`], or [`Error::Conflict`] when it has a result or is open.
pub async fn retry(director: &Director, id: TrialId) -> Result<Trial, Error> {
    record::retried(director.store(), id).await?;
    director.changed();
    Ok(trials::get(&mut *director.store().read().await?, id).await?)
}
