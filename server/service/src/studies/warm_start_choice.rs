//! Chooses the gait from which the next solve of a study starts: the incumbent or the root gait.

use super::ranking::by_mean;
use super::snapshot::StudySnapshot;
use gait_learner::{LearnerError, Posterior};
use gaitwright_store::TrialId;
use gaitwright_store::studies::WarmStartFrom;

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

/// The first trial with a gait. The root gait stays the same whether or not it is executable.
pub(super) fn root_trial(snapshot: &StudySnapshot) -> Option<TrialId> {
    snapshot.trials.iter().find(|trial| trial.state.has_gait()).map(|trial| trial.id)
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
