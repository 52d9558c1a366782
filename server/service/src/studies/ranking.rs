//! The ranking of the gaits of a study by their utility.

use super::snapshot::StudySnapshot;
use gait_learner::{LearnerError, Posterior};
use gaitwright_store::TrialId;
use gaitwright_store::trials::{Trial, TrialState};

/// The gaits of a study without a safety report in force, by decreasing posterior mean. The first is recommended.
///
/// # Errors
/// When a trial's action is not in the search space.
pub fn ranking(snapshot: &StudySnapshot, posterior: &Posterior) -> Result<Vec<TrialId>, LearnerError> {
    by_mean(snapshot, posterior, |trial| !snapshot.grounds.safety_reports.unsafe_motions.include(trial))
}

/// Converged trials by decreasing posterior mean; ties by number.
///
/// # Errors
/// As [`ranking`].
pub(super) fn by_mean(
    snapshot: &StudySnapshot,
    posterior: &Posterior,
    counts: impl Fn(&Trial) -> bool,
) -> Result<Vec<TrialId>, LearnerError> {
    let mut ranked = Vec::new();
    for trial in snapshot.trials.iter().filter(|trial| trial.state == TrialState::Converged && counts(trial)) {
        ranked.push((posterior.mean(trial.action_index)?, trial.id));
    }
    ranked.sort_by(|(mean_a, _), (mean_b, _)| mean_b.total_cmp(mean_a));
    Ok(ranked.into_iter().map(|(_, id)| id).collect())
}
