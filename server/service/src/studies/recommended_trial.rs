//! The recommended trial of a study, and the ranking that pages and REST show.

use super::analysis::{Analyses, too_large_to_wait};
use super::ranking::ranking;
use super::snapshot::StudySnapshot;
use gait_learner::{LearnerError, Posterior};
use gaitwright_compute::OnPool;
use gaitwright_store::TrialId;
use gaitwright_store::trials::TrialState;

/// The recommended trial: the one with the highest posterior mean among gaits without a safety report in force.
///
/// # Errors
/// When a trial's action is not in the search space.
pub fn best_trial(snapshot: &StudySnapshot, posterior: &Posterior) -> Result<Option<TrialId>, LearnerError> {
    Ok(ranking(snapshot, posterior)?.first().copied())
}

/// The ranking for pages. If the study is too large to compute a posterior in a request, it has only the trial that was best
/// at the time of the newest proposal.
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
    (best.state == TrialState::Converged && !snapshot.grounds.safety_reports.unsafe_motions.include(best))
        .then_some(best.id)
}
