//! What to try next, as a pure function of where the study stands.

use super::search;
use super::seed::{Purpose, derive};
use super::standing::Standing;
use crate::store::TrialId;
use crate::store::trials::{NewTrial, Trial, TrialState};
use gait_learner::{LearnerError, Posterior, ProposalReason, posterior, propose};
use gait_optimizer::ModelError;
use thiserror::Error;

/// Why no trial could be chosen.
#[derive(Debug, Error)]
pub enum ChoiceError {
    /// The learner refused.
    #[error(transparent)]
    Learner(#[from] LearnerError),
    /// The action makes no valid bounds.
    #[error(transparent)]
    Bounds(#[from] ModelError),
}

impl ChoiceError {
    /// Whether every action of the search space was tried: the end of a study, not a fault.
    pub fn is_exhausted(&self) -> bool {
        matches!(self, Self::Learner(LearnerError::Exhausted { .. }))
    }
}

/// The next trial of a study. Depends on the standing alone: the same log gives the same trial, bit for bit.
///
/// # Errors
/// [`ChoiceError`], among them that every action was tried.
pub fn next_trial(standing: &Standing) -> Result<NewTrial, ChoiceError> {
    let plan = &standing.study.plan;
    let number = standing.trials.last().map_or(1, |trial| trial.number + 1);
    let log = standing.log();
    let seed = derive(plan.seed, Purpose::Proposal, u64::from(number));
    let proposal = propose(&plan.search_space, &log, &standing.taken_without_result(), &plan.learner, seed)?;
    let belief = posterior(&plan.search_space, &log, &plan.learner)?;
    Ok(NewTrial {
        number,
        action_index: proposal.action,
        action: search::bounds_of(&plan.search_space, plan.base_bounds, proposal.action)?,
        reason: reason_in_words(proposal.reason),
        best_before: proposal.best.and_then(|action| standing.trial_of(action)).map(|trial| trial.id),
        warm_started_from: best_converged(standing, &belief)?,
    })
}

/// The converged trial with the highest posterior mean, the earliest of equals: the gait to start from.
///
/// # Errors
/// When a trial's action is not in the search space.
pub fn best_converged(standing: &Standing, belief: &Posterior) -> Result<Option<TrialId>, LearnerError> {
    highest(standing, belief, |_| true)
}

fn highest(
    standing: &Standing,
    belief: &Posterior,
    counts: impl Fn(&Trial) -> bool,
) -> Result<Option<TrialId>, LearnerError> {
    let mut best: Option<(TrialId, f64)> = None;
    for trial in standing.trials.iter().filter(|trial| trial.state == TrialState::Converged && counts(trial)) {
        let mean = belief.mean(trial.action_index)?;
        if best.is_none_or(|(_, highest)| mean > highest) {
            best = Some((trial.id, mean));
        }
    }
    Ok(best.map(|(id, _)| id))
}

/// The recommended trial: of the visited ones, that with the highest posterior mean. What has no gait, and a gait that
/// somebody called unsafe, is never recommended.
///
/// # Errors
/// When the learner refuses the log.
pub fn best_trial(standing: &Standing) -> Result<Option<TrialId>, LearnerError> {
    let plan = &standing.study.plan;
    let belief = posterior(&plan.search_space, &standing.log(), &plan.learner)?;
    let best = belief.best().and_then(|action| standing.trial_of(action)).map(|trial| trial.id);
    match best.filter(|best| standing.may_be_recommended(*best)) {
        Some(best) => Ok(Some(best)),
        None => highest(standing, &belief, |trial| standing.may_be_recommended(trial.id)),
    }
}

/// The gaits of a study that nobody called unsafe, the recommended one first, then by posterior mean; of a large study, the
/// best one alone.
///
/// # Errors
/// When the learner refuses the log.
pub fn ranking(standing: &Standing) -> Result<Vec<TrialId>, LearnerError> {
    let best = best_to_show(standing)?;
    if standing.trials.len() >= MANY {
        return Ok(best.into_iter().collect());
    }
    let plan = &standing.study.plan;
    let belief = posterior(&plan.search_space, &standing.log(), &plan.learner)?;
    let mut ranked = Vec::new();
    for trial in standing.trials.iter().filter(|trial| standing.may_be_recommended(trial.id)) {
        ranked.push((belief.mean(trial.action_index)?, trial.id));
    }
    ranked.sort_by(|(mean_a, a), (mean_b, b)| {
        let first = |id: &TrialId| best != Some(*id);
        first(a).cmp(&first(b)).then(mean_b.total_cmp(mean_a))
    });
    Ok(ranked.into_iter().map(|(_, id)| id).collect())
}

/// From so many trials on, pages show what the learner last believed instead of asking it anew.
pub const MANY: usize = 400;

/// The best trial for showing: of a large study, what was the best when the newest trial was proposed.
///
/// # Errors
/// When the learner refuses the log.
pub fn best_to_show(standing: &Standing) -> Result<Option<TrialId>, LearnerError> {
    if standing.trials.len() >= MANY {
        return Ok(last_believed(standing));
    }
    best_trial(standing)
}

/// What the learner last believed to be best, unless it has no gait or somebody called it unsafe; it does not take every
/// trial to tell.
pub fn last_believed(standing: &Standing) -> Option<TrialId> {
    let best = standing.trials.last().and_then(|newest| newest.best_before);
    best.filter(|best| standing.may_be_recommended(*best))
}

fn reason_in_words(reason: ProposalReason) -> String {
    match reason {
        ProposalReason::FirstAction => "first one: drawn at random",
        ProposalReason::RandomAction => "drawn at random",
        ProposalReason::ThompsonOnLine => "on a line through the best",
        ProposalReason::ExpectedBestUtility => "highest expected utility beside the best",
        ProposalReason::LinesExhausted => "lines exhausted: drawn at random",
        _ => "chosen by the learner",
    }
    .to_owned()
}
