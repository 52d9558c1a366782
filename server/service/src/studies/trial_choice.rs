//! Chooses the next trial and the best trial of a study, as pure functions of its snapshot.

use super::analysis::{Analyses, too_large_to_wait};
use super::bound_grid;
use super::equal_actions::equal_actions;
use super::ranking::{by_mean, ranking};
use super::seed::{Purpose, derive};
use super::snapshot::StudySnapshot;
use gait_learner::{LearnerError, Posterior, ProposalReason, propose, propose_outside};
use gait_optimizer::ModelError;
use gaitwright_compute::OnPool;
use gaitwright_store::TrialId;
use gaitwright_store::studies::WarmStartFrom;
use gaitwright_store::trials::{NewTrial, TrialState};
use thiserror::Error;

/// Why no trial could be chosen.
#[derive(Debug, Error)]
pub enum ChoiceError {
    /// The learner failed.
    #[error(transparent)]
    Learner(#[from] LearnerError),
    /// The action gives invalid bounds.
    #[error(transparent)]
    Bounds(#[from] ModelError),
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
    let barred = snapshot.barred_without_result();
    let proposal = if plan.excludes_known_gaits() {
        let known = equal_actions(snapshot)?;
        propose_outside(&plan.search_space, &log, &barred, &known, &plan.learner, seed)?
    } else {
        propose(&plan.search_space, &log, &barred, &plan.learner, seed)?
    };
    Ok(NewTrial {
        number,
        action_index: proposal.action,
        action: bound_grid::bounds_of(&plan.search_space, plan.base_bounds, proposal.action)?,
        reason: reason_in_words(proposal.reason, snapshot.has_best_action()),
        best_before: proposal.best.and_then(|action| snapshot.trial_of(action)).map(|trial| trial.id),
        warm_started_from: warm_start_of_next(snapshot, posterior)?,
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

/// The trial from whose gait the next solve starts.
///
/// # Errors
/// When a trial's action is not in the search space.
pub fn warm_start_of_next(snapshot: &StudySnapshot, posterior: &Posterior) -> Result<Option<TrialId>, LearnerError> {
    match snapshot.study.plan.warm_start_from {
        WarmStartFrom::Incumbent => best_converged(snapshot, posterior),
        WarmStartFrom::Root => Ok(root_trial(snapshot)),
    }
}

/// The first converged trial.
fn root_trial(snapshot: &StudySnapshot) -> Option<TrialId> {
    snapshot.trials.iter().find(|trial| trial.state == TrialState::Converged).map(|trial| trial.id)
}

/// Whether a study has to wait for its root gait before the next trial.
pub fn awaits_root(snapshot: &StudySnapshot) -> bool {
    snapshot.study.plan.warm_start_from == WarmStartFrom::Root && root_trial(snapshot).is_none() && snapshot.open() > 0
}

/// The converged trial with the highest posterior mean. The earliest wins a tie.
///
/// # Errors
/// When a trial's action is not in the search space.
pub fn best_converged(snapshot: &StudySnapshot, posterior: &Posterior) -> Result<Option<TrialId>, LearnerError> {
    Ok(by_mean(snapshot, posterior, |_| true)?.first().copied())
}

/// The recommended trial: the one with the highest posterior mean among gaits without a safety report in force.
///
/// # Errors
/// As [`best_converged`].
pub fn best_trial(snapshot: &StudySnapshot, posterior: &Posterior) -> Result<Option<TrialId>, LearnerError> {
    Ok(ranking(snapshot, posterior)?.first().copied())
}

/// The ranking for pages. Of a study whose posterior no request waits for, it has only the trial that was best when the
/// newest one was proposed.
///
/// # Errors
/// When the learner cannot work with the log.
pub fn ranking_to_show(
    pool: &OnPool,
    snapshot: &StudySnapshot,
    analyses: &Analyses,
) -> Result<Vec<TrialId>, LearnerError> {
    if too_large_to_wait(snapshot.trials.len(), snapshot.feedback.len()).is_some() {
        return Ok(last_known_best(snapshot).into_iter().collect());
    }
    ranking(snapshot, &*analyses.posterior(pool, snapshot)?)
}

/// The trial that was best at the newest proposal, if its gait has no safety report in force. Needs only the newest trials.
pub fn last_known_best(snapshot: &StudySnapshot) -> Option<TrialId> {
    let best = snapshot.trials.last().and_then(|newest| newest.best_before).and_then(|best| snapshot.trial(best))?;
    (best.state == TrialState::Converged && !snapshot.grounds.safety_reports.forbids(best)).then_some(best.id)
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
