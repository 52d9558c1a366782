//! Commands for studies (start, pause, resume, stop) and the retry of trials, each in one transaction.

use super::cancelled_trial;
use super::lifecycle::{self, StudyTransition};
use super::requeued_trial;
use super::snapshot::has_changed;
use crate::error::Error;
use crate::printable;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::studies::Study;
use gaitwright_store::{StudyId, TrialId, Writer, events, studies, trials};
use serde_json::json;

/// The result of a command. The solves of `cancelled` must be stopped once the command is durable.
#[derive(Debug)]
pub struct Done {
    /// The study.
    pub study: Study,
    /// Trials that the command cancelled.
    pub cancelled: Vec<TrialId>,
}

/// Carries out a command, if the state of the study allows it.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Invalid`] for a reason that is too long or does not print, [`Error::Conflict`] with the possible
/// commands.
pub async fn transition(
    writer: &mut Writer,
    actor: &Actor,
    id: StudyId,
    transition: StudyTransition,
    reason: &str,
) -> Result<Done, Error> {
    printable::note("reason", reason, 2000)?;
    let study = studies::get(writer, id).await?;
    let cancelled = if transition == StudyTransition::Stop {
        stop(writer, &study, reason).await?
    } else {
        change_state(writer, &study, transition, reason).await?;
        Vec::new()
    };
    let changed = studies::get(writer, id).await?;
    let detail = json!({ "from": study.state, "to": changed.state, "reason": reason });
    audit::append(writer, actor, &format!("study.{}", transition.as_str()), &format!("study {id}"), &detail).await?;
    Ok(Done { study: changed, cancelled })
}

/// Stops a study and returns its open trials, which it cancels. The caller writes the audit trail.
///
/// # Errors
/// [`Error::Conflict`] if the study has ended.
pub(super) async fn stop(writer: &mut Writer, study: &Study, reason: &str) -> Result<Vec<TrialId>, Error> {
    let mut cancelled = Vec::new();
    for trial in trials::of_study(writer, study.id).await?.into_iter().filter(|trial| trial.state.is_open()) {
        cancelled_trial::end(writer, trial.id, "The study was stopped.").await?;
        cancelled.push(trial.id);
    }
    change_state(writer, study, StudyTransition::Stop, reason).await?;
    Ok(cancelled)
}

async fn change_state(
    writer: &mut Writer,
    study: &Study,
    transition: StudyTransition,
    reason: &str,
) -> Result<(), Error> {
    let state = lifecycle::after(study.state, transition)?;
    if !studies::set_state(writer, study, state, reason).await? {
        return Err(has_changed());
    }
    Ok(events::append(writer, study.id, "study_changed", &json!({ "state": state, "reason": reason })).await?)
}

/// Queues a trial without a result again.
///
/// # Errors
/// [`Error::NotFound`], or [`Error::Conflict`] if the trial is open or has a result.
pub async fn retry(writer: &mut Writer, actor: &Actor, id: TrialId) -> Result<(), Error> {
    requeued_trial::retried(writer, id).await?;
    Ok(audit::append(writer, actor, "trial.retry", &format!("trial {id}"), &json!({})).await?)
}
