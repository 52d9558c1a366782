//! Decides which gaits of a study can be overlaid on the gait of a trial in charts.

use super::identical_gaits::{is_same_gait, pooled};
use super::preference_answer::comparable;
use crate::error::{Error, FieldError};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Connection, TrialId, gaits, trials};

/// So many gaits can be overlaid on that of a trial: more lines in a chart cannot be told apart.
pub const MAX_OTHERS: usize = 3;

/// The other trials whose gaits are overlaid on that of `trial`; `field` names them.
///
/// # Errors
/// [`Error::Invalid`] for too many trials, for a trial of another study, without a converged gait or without its
/// trajectory, and for two trials with the same gait.
pub async fn others(db: &mut Connection, trial: &Trial, field: &str, ids: &[TrialId]) -> Result<Vec<Trial>, Error> {
    if ids.len() > MAX_OTHERS {
        let message = format!("At most {MAX_OTHERS} other gaits can be overlaid; {} are chosen.", ids.len());
        return Err(FieldError::in_words(field, &message).into());
    }
    let mut others: Vec<Trial> = Vec::new();
    for id in ids {
        let other = comparable(db, trial.study_id, field, *id).await?;
        if let Some(same) = std::iter::once(trial).chain(&others).find(|known| is_same_gait(known, &other)) {
            let allowed = if same.id == other.id {
                format!("a trial that is not named twice, unlike trial {}", same.number)
            } else {
                format!("a different gait: trials {} and {} have the same one", same.number, other.number)
            };
            return Err(Error::invalid(field, id.to_string(), &allowed));
        }
        if !gaits::exists(db, *id).await? {
            let allowed = format!("a trial whose trajectory is in the record; that of trial {} is not", other.number);
            return Err(Error::invalid(field, id.to_string(), &allowed));
        }
        others.push(other);
    }
    Ok(others)
}

/// The trials among the newest ones of the study whose gaits can be overlaid on that of `trial`. Trials with the same gait
/// are in one group, in the order of their numbers.
///
/// # Errors
/// Errors of the database.
pub async fn offered(db: &mut Connection, trial: &Trial, newest: u32) -> Result<Vec<Vec<Trial>>, Error> {
    let mut found = trials::newest(db, trial.study_id, None, newest).await?;
    found.retain(|other| other.state == TrialState::Converged && !is_same_gait(trial, other));
    let kept = gaits::existing(db, &found.iter().map(|other| other.id).collect::<Vec<_>>()).await?;
    found.retain(|other| kept.contains(&other.id));
    Ok(pooled(found.iter().collect()).into_iter().map(|pool| pool.into_iter().cloned().collect()).collect())
}
