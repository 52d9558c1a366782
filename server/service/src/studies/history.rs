//! The best action by iteration: what the study would have recommended after each result.
//!
//! An iteration is a result. Results count in the order in which they came, which is the order of the trials' numbers
//! unless several trials run at the same time.

use super::snapshot::StudySnapshot;
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Instant, TrialId};
use serde::Serialize;
use std::collections::HashMap;
use utoipa::ToSchema;

/// The recommendation after some results.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Milestone {
    /// After how many results this held: 1, 2, ...
    pub iteration: u32,
    /// The best trial then.
    pub trial_id: TrialId,
    /// Its number.
    pub number: u32,
    /// Its Gait RMSE, rad; none when it did not converge.
    pub gait_rmse_rad: Option<f64>,
    /// Its cost of transport.
    pub cost_of_transport: Option<f64>,
}

/// The trials that gave a result, in the order in which they did: the first is iteration 1.
pub fn results(snapshot: &StudySnapshot) -> Vec<&Trial> {
    labelled(snapshot).into_iter().map(|(_, trial)| trial).collect()
}

/// With the instant at which each was recorded.
fn labelled(snapshot: &StudySnapshot) -> Vec<(Instant, &Trial)> {
    let by_id: HashMap<TrialId, &Trial> = snapshot.trials.iter().map(|trial| (trial.id, trial)).collect();
    let label = |row: &FeedbackRow| match row.said {
        FeedbackContent::Label { trial, .. } => by_id.get(&trial).map(|trial| (row.created_at, *trial)),
        _ => None,
    };
    snapshot.feedback.iter().filter_map(label).collect()
}

/// How many results were there when a trial was proposed.
fn results_before(labelled: &[(Instant, &Trial)], proposed: &Trial) -> usize {
    let mut count = labelled.partition_point(|(at, _)| *at <= proposed.created_at);
    // Within one millisecond: what was proposed later cannot have been there before.
    while count > 0 && labelled[count - 1].1.number >= proposed.number {
        count -= 1;
    }
    count
}

/// The best trial after each iteration at which it was asked for. What the learner believed when it proposed a trial is
/// the best after the results that were there then; after the last one, what it believes now. The first gait there is
/// is the best one until more is known. `best`: the best trial now.
pub fn of(snapshot: &StudySnapshot, best: Option<TrialId>) -> Vec<Milestone> {
    let labelled = labelled(snapshot);
    let by_id: HashMap<TrialId, &Trial> = snapshot.trials.iter().map(|trial| (trial.id, trial)).collect();
    let milestone = |results: usize, id: TrialId| {
        let best = by_id.get(&id).filter(|best| best.state == TrialState::Converged)?;
        Some(Milestone {
            iteration: u32::try_from(results).ok()?,
            trial_id: id,
            number: best.number,
            gait_rmse_rad: best.gait_rmse_rad,
            cost_of_transport: best.cost_of_transport,
        })
    };
    let mut milestones: Vec<Milestone> = Vec::new();
    let first = labelled.iter().position(|(_, trial)| trial.state == TrialState::Converged);
    milestones.extend(first.and_then(|index| milestone(index + 1, labelled[index].1.id)));
    let proposed = snapshot.trials.iter();
    milestones.extend(proposed.filter_map(|trial| milestone(results_before(&labelled, trial), trial.best_before?)));
    if !labelled.is_empty()
        && let Some(best) = best
    {
        milestones.extend(milestone(labelled.len(), best));
    }
    // Of several after the same results, the last one had heard the most.
    milestones.sort_by_key(|milestone| milestone.iteration);
    milestones.reverse();
    milestones.dedup_by_key(|milestone| milestone.iteration);
    milestones.reverse();
    milestones
}

/// What is known of some trials without asking the learner: the best when each was proposed. Iterations are those of
/// one trial at a time.
pub fn known(snapshot: &StudySnapshot) -> Vec<Milestone> {
    let by_id: HashMap<TrialId, &Trial> = snapshot.trials.iter().map(|trial| (trial.id, trial)).collect();
    let best_before = |trial: &Trial| {
        let best = by_id.get(&trial.best_before?).filter(|best| best.state == TrialState::Converged)?;
        Some(Milestone {
            iteration: trial.number - 1,
            trial_id: best.id,
            number: best.number,
            gait_rmse_rad: best.gait_rmse_rad,
            cost_of_transport: best.cost_of_transport,
        })
    };
    snapshot.trials.iter().filter_map(best_before).collect()
}
