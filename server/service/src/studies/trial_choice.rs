//! Chooses the next trial of a study, as a pure function of its snapshot.

use super::actions_with_known_gait::actions_with_known_gait;
use super::atlas;
use super::bound_grid;
use super::excluded_actions::excluded_without_result;
use super::seed::{Purpose, derive};
use super::snapshot::StudySnapshot;
use super::warm_start_choice::{root_trial, warm_start_of_next};
use crate::error::Error;
use gait_learner::{ActionIndex, LearnerError, Posterior, ProposalReason, propose, propose_outside};
use gait_optimizer::ModelError;
use gaitwright_compute::OnPool;
use gaitwright_store::studies::WarmStartFrom;
use gaitwright_store::trials::NewTrial;

/// Follows the reason of a trial whose gait the atlas has. All actions of a gait are one for the learner, so the trial has the
/// action with which the atlas found it.
const FROM_ATLAS: &str = "; its gait is in the atlas";

/// Why no trial could be chosen.
#[derive(Debug, thiserror::Error)]
pub enum ChoiceError {
    /// The learner failed.
    #[error(transparent)]
    Learner(#[from] LearnerError),
    /// The action gives invalid bounds.
    #[error(transparent)]
    Bounds(#[from] ModelError),
}

impl From<ChoiceError> for Error {
    fn from(error: ChoiceError) -> Self {
        match error {
            ChoiceError::Learner(error) => Self::Learner(error),
            ChoiceError::Bounds(error) => error.into(),
        }
    }
}

impl ChoiceError {
    /// Whether the gait of every action of the search space is known, which ends a study.
    pub fn is_exhausted(&self) -> bool {
        matches!(self, Self::Learner(LearnerError::Exhausted { .. }))
    }
}

/// The next trial of a study. It depends on the snapshot alone: the same log gives the same trial, bit for bit.
///
/// # Errors
/// [`ChoiceError`], even if every action was tried.
pub fn next_trial(_: &OnPool, snapshot: &StudySnapshot, posterior: &Posterior) -> Result<NewTrial, ChoiceError> {
    let plan = &snapshot.study.plan;
    let number = snapshot.trials.last().map_or(1, |trial| trial.number + 1);
    if plan.warm_start_from == WarmStartFrom::Root && snapshot.trials.is_empty() {
        return root(snapshot);
    }
    let log = snapshot.log();
    let seed = derive(plan.seed, Purpose::Proposal, u64::from(number));
    let excluded = excluded_without_result(snapshot);
    let proposal = if plan.excludes_known_gaits() {
        let known = actions_with_known_gait(snapshot)?;
        propose_outside(&plan.search_space, &log, &excluded, &known, &plan.learner, seed)?
    } else {
        propose(&plan.search_space, &log, &excluded, &plan.learner, seed)?
    };
    let in_atlas = atlas::representative(snapshot, proposal.action);
    let action_index = in_atlas.unwrap_or(proposal.action);
    let mut reason = reason_in_words(proposal.reason, snapshot.has_best_action());
    if in_atlas.is_some() {
        reason.push_str(FROM_ATLAS);
    }
    Ok(NewTrial {
        number,
        action_index,
        action: bound_grid::bounds_of(&plan.search_space, plan.base_bounds, action_index)?,
        reason,
        best_before: proposal.best.and_then(|action| snapshot.trial_of(action)).map(|trial| trial.id),
        warm_started_from: warm_start_of_next(snapshot, posterior)?,
    })
}

/// The trial of an action that an atlas solves next.
///
/// # Errors
/// When the action gives invalid bounds.
pub(super) fn trial_of_atlas(snapshot: &StudySnapshot, action_index: ActionIndex) -> Result<NewTrial, ChoiceError> {
    let plan = &snapshot.study.plan;
    Ok(NewTrial {
        number: snapshot.trials.last().map_or(1, |trial| trial.number + 1),
        action_index,
        action: bound_grid::bounds_of(&plan.search_space, plan.base_bounds, action_index)?,
        reason: "next action without a known gait".to_owned(),
        best_before: None,
        warm_started_from: root_trial(snapshot),
    })
}

/// The trial of the root gait: the action nearest to the bounds that the study starts from.
fn root(snapshot: &StudySnapshot) -> Result<NewTrial, ChoiceError> {
    let plan = &snapshot.study.plan;
    let action_index = bound_grid::nearest_action(&plan.search_space, plan.base_bounds)?;
    Ok(NewTrial {
        number: 1,
        action_index,
        action: bound_grid::bounds_of(&plan.search_space, plan.base_bounds, action_index)?,
        reason: "nearest to the default bounds: its gait is the root gait".to_owned(),
        best_before: None,
        warm_started_from: None,
    })
}

/// Without a best action, the learner works from one of the actions tried.
fn reason_in_words(reason: ProposalReason, has_best_action: bool) -> String {
    match reason {
        ProposalReason::ThompsonOnLine if !has_best_action => "on a line through an action tried before",
        ProposalReason::ExpectedBestUtility if !has_best_action => "most useful comparison with an action tried before",
        ProposalReason::FirstAction => "first trial, drawn at random",
        ProposalReason::RandomAction => "drawn at random",
        ProposalReason::ThompsonOnLine => "on a line through the best action",
        ProposalReason::ExpectedBestUtility => "most useful comparison with the best action",
        ProposalReason::LinesExhausted => "drawn at random, because no action was left on the lines",
        _ => "chosen by the learner",
    }
    .to_owned()
}
