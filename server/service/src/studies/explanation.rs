//! Why a trial has no gait: found out when somebody asks or its study has ended, then kept.

use super::solve_input::{PackedInput, SolveInput};
use crate::error::Error;
use crate::workers::Unexplained;
use gait_optimizer::explanation::Explanation;
use gait_optimizer::{SolveStatus, Violation, WarmStart};
use gaitwright_compute::OnPool;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::explanations::{self, Explained};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Connection, Packed, Store, TrialId, Writer, commit, consents, events, gaits, studies, trials};
use serde_json::json;

/// Where the explanation of a trial stands.
#[derive(Debug, Clone, PartialEq)]
pub enum ExplanationState {
    /// It was made.
    Made(Box<Explained>),
    /// It is made now, or after those that were asked for before.
    BeingMade,
    /// Its turn comes after others of its study; who asks gets it before them.
    Waiting,
    /// It cannot be made, and why.
    Refused(String),
    /// Nobody asked for it.
    NotAsked,
}

/// What this process does about the explanation of a trial.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Effort {
    /// It explains nothing.
    None,
    /// It explains what is asked for, and studies that have ended, but not this trial at present.
    Ready,
    /// It is at it.
    Running,
    /// It tried, and why it could not.
    Refused(String),
}

/// Where the explanation of a trial stands.
///
/// # Errors
/// What the database reports.
pub async fn state(db: &mut Connection, trial: &Trial, effort: Effort) -> Result<ExplanationState, Error> {
    if let Some(made) = explanations::find(db, trial.id).await? {
        return Ok(ExplanationState::Made(Box::new(made)));
    }
    let ready = match effort {
        Effort::Refused(reason) => return Ok(ExplanationState::Refused(reason)),
        Effort::Running => return Ok(ExplanationState::BeingMade),
        Effort::Ready => true,
        Effort::None => false,
    };
    if explanations::is_requested(db, trial.id).await? {
        return Ok(ExplanationState::BeingMade);
    }
    if !ready || !studies::get(db, trial.study_id).await?.state.has_ended() {
        return Ok(ExplanationState::NotAsked);
    }
    match explainable(db, trial).await {
        Ok(_) => Ok(ExplanationState::Waiting),
        Err(Error::Conflict(_)) => Ok(ExplanationState::NotAsked),
        Err(error) => Err(error),
    }
}

/// Asks for the explanation of a trial. `None`: it is being made.
///
/// # Errors
/// [`Error::Conflict`] when it cannot be made or the subject withdrew, [`Error::NotFound`], or what the database reports.
pub async fn ask(writer: &mut Writer, actor: &Actor, id: TrialId, effort: Effort) -> Result<Option<Explained>, Error> {
    let trial = trials::get(writer, id).await?;
    consents::may_be_shown(writer, trial.study_id).await?;
    match state(writer, &trial, effort).await? {
        ExplanationState::Made(made) => Ok(Some(*made)),
        ExplanationState::BeingMade => Ok(None),
        ExplanationState::Refused(reason) => Err(refusal(&trial, &reason)),
        ExplanationState::Waiting | ExplanationState::NotAsked => {
            explainable(writer, &trial).await?;
            explanations::request(writer, id, actor).await?;
            audit::append(writer, actor, "trial.ask_explanation", &format!("trial {id}"), &json!({})).await?;
            Ok(None)
        }
    }
}

/// That a trial cannot be explained, and why.
pub fn refusal(trial: &Trial, reason: &str) -> Error {
    Error::conflict(format!("trial {} cannot be explained: {reason}", trial.number))
}

/// What the solve of a trial without a gait left, as it was read.
pub(super) struct PackedSolve {
    status: SolveStatus,
    violations: Vec<Violation>,
    last: Packed<WarmStart>,
    input: PackedInput,
}

impl PackedSolve {
    /// What there is to explain, and the problem as a file.
    ///
    /// # Errors
    /// What the record reports of damage.
    pub(super) fn unpack(self, pool: &OnPool) -> Result<(Unexplained, String), Error> {
        let Self { status, violations, last, input } = self;
        let input = input.unpack(pool)?;
        let file = input.to_json()?;
        let SolveInput { problem, options, .. } = input;
        Ok((Unexplained { problem, options, status, violations, last: last.unpack(pool)? }, file))
    }
}

/// What the solve of a trial without a gait left.
///
/// # Errors
/// [`Error::Conflict`] when there is nothing to explain, [`Error::NotFound`] for what was dropped, or what the database
/// reports.
pub(super) async fn unexplained(db: &mut Connection, id: TrialId) -> Result<PackedSolve, Error> {
    let trial = trials::get(db, id).await?;
    let status = explainable(db, &trial).await?;
    let last = gaits::warm_start(db, id).await?;
    let input = PackedInput::of_trial(db, id).await?;
    Ok(PackedSolve { status, violations: trial.violations, last, input })
}

/// Keeps what was found out about a problem.
///
/// # Errors
/// [`Error::Conflict`] when the subject withdrew, or what the database reports.
pub(super) async fn record(store: &Store, id: TrialId, problem: &str, explanation: &Explanation) -> Result<(), Error> {
    let mut writer = store.write().await?;
    if explanations::keep(&mut writer, id, problem, explanation).await? {
        let trial = trials::get(&mut writer, id).await?;
        let relieved_by = explanation.relief().map(|relaxation| &relaxation.bound);
        let payload = json!({ "trial_id": id, "number": trial.number, "relieved_by": relieved_by });
        events::append(&mut writer, trial.study_id, "trial_explained", &payload).await?;
        let detail = json!({ "relieved_by": relieved_by });
        audit::append(&mut writer, &Actor::program(), "trial.explain", &format!("trial {id}"), &detail).await?;
    }
    Ok(commit(writer).await?)
}

/// How the program's own solve of a trial ended without a gait, where its last iterate was kept.
async fn explainable(db: &mut Connection, trial: &Trial) -> Result<SolveStatus, Error> {
    let number = trial.number;
    if trial.asked_by.is_some() {
        return Err(Error::conflict(format!("a script evaluated trial {number}: there is no solve to explain")));
    }
    let Some(status) = trial.status.filter(|_| trial.state == TrialState::NotConverged) else {
        let state = trial.state.as_str();
        return Err(Error::conflict(format!(
            "trial {number} is {state}: only a trial that did not converge is explained"
        )));
    };
    if !gaits::is_here(db, trial.id).await? {
        return Err(Error::conflict(format!("the last iterate of trial {number} was not kept")));
    }
    Ok(status)
}
