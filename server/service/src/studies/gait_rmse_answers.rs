//! The preferences that Gait RMSE implies where it answers in place of people.

use super::snapshot::StudySnapshot;
use crate::error::Error;
use gait_learner::{LearnerError, proposed_comparisons_among};
use gaitwright_compute::OnPool;
use gaitwright_store::TrialId;
use gaitwright_store::feedback::FeedbackContent;
use gaitwright_store::studies::AnswerSource;

/// The preferences about a new converged trial; none if people answer. `snapshot` does not have the result of the new
/// trial yet.
///
/// # Errors
/// When the learner cannot work with the log.
pub(super) fn gait_rmse_answers(
    pool: &OnPool,
    snapshot: &StudySnapshot,
    new: TrialId,
    gait_rmse_rad: f64,
) -> Result<Vec<FeedbackContent>, Error> {
    if snapshot.study.plan.answer_source == AnswerSource::People {
        return Ok(Vec::new());
    }
    let partners = partners(pool, snapshot, new).map_err(Error::Learner)?;
    let answer = |id| Some(by_gait_rmse((new, gait_rmse_rad), (id, snapshot.trial(id)?.gait_rmse_rad?)));
    Ok(partners.into_iter().filter_map(answer).collect())
}

/// The earlier converged trials that a new converged trial is compared with: the best one or the latest ones, depending
/// on the settings of the learner. `snapshot` does not have the result of the new trial yet.
///
/// # Errors
/// When the learner cannot work with the log.
fn partners(_: &OnPool, snapshot: &StudySnapshot, new: TrialId) -> Result<Vec<TrialId>, LearnerError> {
    let Some(new) = snapshot.trial(new) else { return Ok(Vec::new()) };
    let plan = &snapshot.study.plan;
    let comparable = snapshot.comparable();
    let log = snapshot.log();
    let proposed = proposed_comparisons_among(&plan.search_space, &log, new.action_index, &plan.learner, |a| {
        comparable.contains(&a)
    })?;
    Ok(proposed.into_iter().filter_map(|c| snapshot.trial_of(c.against)).map(|trial| trial.id).collect())
}

/// The preference that Gait RMSE implies: the smaller value is better, equal values mean no difference.
pub(super) fn by_gait_rmse(new: (TrialId, f64), old: (TrialId, f64)) -> FeedbackContent {
    if new.1 < old.1 {
        FeedbackContent::Preference { winner: new.0, loser: old.0 }
    } else if old.1 < new.1 {
        FeedbackContent::Preference { winner: old.0, loser: new.0 }
    } else {
        FeedbackContent::NoDifference { a: new.0, b: old.0 }
    }
}
