//! The infeasibility explanation of one trial: its state, requests for it, and its storage.

use super::problem_file::{PackedInput, SolveInput};
use super::trial_transitions::has_state;
use crate::error::Error;
use crate::workers::SolveToExplain;
use gait_optimizer::explanation::Explanation;
use gait_optimizer::{SolveStatus, Violation, WarmStart};
use gaitwright_compute::OnPool;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::explanations::{self, StoredExplanation};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Connection, Packed, Store, TrialId, Writer, commit, consents, events, gaits, studies, trials};
use serde_json::json;

/// The state of the explanation of a trial.
#[derive(Debug, Clone, PartialEq)]
pub enum ExplanationState {
    /// The explanation is on record, complete or stopped early.
    Made(Box<StoredExplanation>),
    /// The explanation is being computed or was requested.
    BeingMade,
    /// The explanation follows those of other trials of the study. A request moves it ahead.
    Waiting,
    /// The trial cannot be explained, for this reason.
    Refused(String),
    /// The explanation was not requested.
    NotAsked,
}

/// The state of the explanation of a trial in this process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ExplanationEffort {
    /// This process explains no trials.
    None,
    /// This process explains trials, but is not explaining this one.
    Ready,
    /// The trial is being explained.
    Running(Elapsed),
    /// Somebody cancelled it.
    Cancelled,
    /// The explanation failed, for this reason.
    Refused(String),
}

/// How long the explanation of a trial has been running.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Elapsed {
    /// Seconds since its start.
    pub seconds: u64,
    /// The median duration, s, of the newest explanations of this process; `None` before the first one.
    pub usual_seconds: Option<u64>,
}

/// The state of the explanation of a trial.
///
/// # Errors
/// Errors of the database.
pub async fn state(db: &mut Connection, trial: &Trial, effort: ExplanationEffort) -> Result<ExplanationState, Error> {
    let found = explanations::find(db, trial.id).await?.map(Box::new);
    let is_complete = |made: &StoredExplanation| !made.explanation.stopped_early;
    let stopped = match found {
        Some(made) if is_complete(&made) => return Ok(ExplanationState::Made(made)),
        stopped => stopped.map_or(ExplanationState::NotAsked, ExplanationState::Made),
    };
    let ready = match effort {
        ExplanationEffort::Refused(reason) => return Ok(ExplanationState::Refused(reason)),
        ExplanationEffort::Running(_) => return Ok(ExplanationState::BeingMade),
        ExplanationEffort::Cancelled => return Ok(stopped),
        ExplanationEffort::Ready => true,
        ExplanationEffort::None => false,
    };
    if explanations::is_requested(db, trial.id).await? {
        return Ok(ExplanationState::BeingMade);
    }
    if !ready || !studies::get(db, trial.study_id).await?.state.has_ended() {
        return Ok(stopped);
    }
    match explainable(db, trial).await {
        Ok(_) => Ok(ExplanationState::Waiting),
        Err(Error::Conflict(_)) => Ok(stopped),
        Err(error) => Err(error),
    }
}

/// Requests the explanation of a trial. Returns whether a complete one exists already.
///
/// # Errors
/// [`Error::Conflict`] if the trial cannot be explained or the subject withdrew consent, [`Error::NotFound`], errors of
/// the database.
pub async fn ask(writer: &mut Writer, actor: &Actor, id: TrialId, effort: ExplanationEffort) -> Result<bool, Error> {
    let trial = trials::get(writer, id).await?;
    consents::may_be_shown(writer, trial.study_id).await?;
    match state(writer, &trial, effort).await? {
        ExplanationState::Made(made) if !made.explanation.stopped_early => Ok(true),
        ExplanationState::BeingMade => Ok(false),
        ExplanationState::Refused(reason) => Err(refusal(&trial, &reason)),
        ExplanationState::Made(_) | ExplanationState::Waiting | ExplanationState::NotAsked => {
            explainable(writer, &trial).await?;
            explanations::request(writer, id, actor).await?;
            audit::append(writer, actor, explanations::REQUESTED, &format!("trial {id}"), &json!({})).await?;
            Ok(false)
        }
    }
}

/// The error for a trial that cannot be explained.
pub fn refusal(trial: &Trial, reason: &str) -> Error {
    Error::conflict(format!("Trial {} cannot be explained: {reason}", trial.number))
}

/// The stored outcome of a solve without a gait, still compressed.
pub(super) struct PackedSolve {
    status: SolveStatus,
    violations: Vec<Violation>,
    last: Packed<WarmStart>,
    input: PackedInput,
}

impl PackedSolve {
    /// The solve to explain, and its problem as a file.
    ///
    /// # Errors
    /// [`Error::Store`] if the stored outcome is damaged.
    pub(super) fn unpack(self, pool: &OnPool) -> Result<(SolveToExplain, String), Error> {
        let Self { status, violations, last, input } = self;
        let input = input.unpack(pool)?;
        let file = input.to_json()?;
        let SolveInput { problem, options, .. } = input;
        Ok((SolveToExplain { problem, options, status, violations, last: last.unpack(pool)? }, file))
    }
}

/// Reads the stored outcome of a trial without a gait.
///
/// # Errors
/// [`Error::Conflict`] if there is nothing to explain, [`Error::NotFound`] if data was pruned, errors of the database.
pub(super) async fn unexplained(db: &mut Connection, id: TrialId) -> Result<PackedSolve, Error> {
    let trial = trials::get(db, id).await?;
    let status = explainable(db, &trial).await?;
    let last = gaits::warm_start(db, id).await?;
    let input = PackedInput::of_trial(db, id).await?;
    Ok(PackedSolve { status, violations: trial.violations, last, input })
}

/// Stores the explanation of a problem.
///
/// # Errors
/// [`Error::Conflict`] if the subject withdrew consent; errors of the database.
pub(super) async fn record(store: &Store, id: TrialId, problem: &str, explanation: &Explanation) -> Result<(), Error> {
    let mut writer = store.write().await?;
    if explanations::insert(&mut writer, id, problem, explanation).await? {
        let trial = trials::get(&mut writer, id).await?;
        let relaxed_bound = explanation.relief().map(|relaxation| &relaxation.bound);
        let payload = json!({ "trial_id": id, "number": trial.number, "relaxed_bound": relaxed_bound });
        events::append(&mut writer, trial.study_id, "trial_explained", &payload).await?;
        let detail = json!({ "relaxed_bound": relaxed_bound });
        audit::append(&mut writer, &Actor::program(), "trial.explain", &format!("trial {id}"), &detail).await?;
    }
    Ok(commit(writer).await?)
}

/// The status of a trial that can be explained: our own solve ended without a gait, and its last iterate was kept.
async fn explainable(db: &mut Connection, trial: &Trial) -> Result<SolveStatus, Error> {
    let number = trial.number;
    if trial.script.is_some() {
        return Err(Error::conflict(format!(
            "Trial {number} was evaluated by a script, so there is no solve to explain."
        )));
    }
    let Some(status) = trial.status.filter(|_| trial.state == TrialState::NotConverged) else {
        let state = has_state(trial.state);
        return Err(Error::conflict(format!(
            "Trial {number} {state}. Only a trial that did not converge can be explained."
        )));
    };
    if !gaits::exists(db, trial.id).await? {
        return Err(Error::conflict(format!(
            "The last motion tried in trial {number} is no longer stored, so the trial cannot be explained."
        )));
    }
    Ok(status)
}
