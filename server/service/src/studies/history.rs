//! The history of the recommendation: the best trial after each iteration.
//!
//! Each result is an iteration. Results count in order of arrival, which is the order of trial numbers unless trials
//! run in parallel.

use super::snapshot::StudySnapshot;
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow};
use gaitwright_store::studies::AnswerSource;
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Instant, TrialId};
use serde::Serialize;
use std::collections::HashMap;
use utoipa::ToSchema;

/// The recommendation after one iteration of the study.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct HistoryEntry {
    /// Number of results so far, from 1.
    pub iteration: u32,
    /// Best trial after this iteration of the study.
    pub trial_id: TrialId,
    /// Number of the best trial.
    pub number: u32,
    /// Gait RMSE of the best trial, rad. Null if the script that evaluated the trial did not report it.
    pub gait_rmse_rad: Option<f64>,
    /// Cost of transport of the best trial. Null if the script that evaluated the trial did not report it.
    pub cost_of_transport: Option<f64>,
}

/// The trials with a result, in order of arrival. The first is iteration 1.
pub fn results(snapshot: &StudySnapshot) -> Vec<&Trial> {
    labelled(snapshot).into_iter().map(|(_, trial)| trial).collect()
}

/// The same, with the time at which each result was recorded.
fn labelled(snapshot: &StudySnapshot) -> Vec<(Instant, &Trial)> {
    let by_id: HashMap<TrialId, &Trial> = snapshot.trials.iter().map(|trial| (trial.id, trial)).collect();
    let label = |row: &FeedbackRow| match row.content {
        FeedbackContent::Label { trial, .. } => by_id.get(&trial).map(|trial| (row.created_at, *trial)),
        _ => None,
    };
    snapshot.feedback.iter().filter_map(label).collect()
}

/// The number of results when a trial was proposed.
fn results_before(labelled: &[(Instant, &Trial)], proposed: &Trial) -> usize {
    let mut count = labelled.partition_point(|(at, _)| *at <= proposed.created_at);
    // Within one millisecond, numbers decide: a later proposal cannot have an earlier result.
    while count > 0 && labelled[count - 1].1.number >= proposed.number {
        count -= 1;
    }
    count
}

/// The best trial after each iteration. Each proposal names the best trial after the
/// results at that time; `best` is the current one. Before the first proposal with a best trial, the first gait counts
/// as the best.
pub fn of(snapshot: &StudySnapshot, best: Option<TrialId>) -> Vec<HistoryEntry> {
    let labelled = labelled(snapshot);
    let by_id: HashMap<TrialId, &Trial> = snapshot.trials.iter().map(|trial| (trial.id, trial)).collect();
    let milestone = |results: usize, id: TrialId| {
        let best = by_id.get(&id).filter(|best| best.state == TrialState::Converged)?;
        Some(HistoryEntry {
            iteration: u32::try_from(results).ok()?,
            trial_id: id,
            number: best.number,
            gait_rmse_rad: best.gait_rmse_rad,
            cost_of_transport: best.cost_of_transport,
        })
    };
    let mut milestones: Vec<HistoryEntry> = Vec::new();
    let first = labelled.iter().position(|(_, trial)| trial.state == TrialState::Converged);
    milestones.extend(first.and_then(|index| milestone(index + 1, labelled[index].1.id)));
    let proposed = snapshot.trials.iter();
    milestones.extend(proposed.filter_map(|trial| milestone(results_before(&labelled, trial), trial.best_before?)));
    if !labelled.is_empty()
        && let Some(best) = best
    {
        milestones.extend(milestone(labelled.len(), best));
    }
    // Among proposals after the same number of results, the last one knew the most answers.
    milestones.sort_by_key(|milestone| milestone.iteration);
    milestones.reverse();
    milestones.dedup_by_key(|milestone| milestone.iteration);
    milestones.reverse();
    let rmse_decides = snapshot.study.plan.answer_source == AnswerSource::GaitRmse;
    at_every_iteration(&milestones, &labelled, rmse_decides)
}

/// Adds the iterations after which the learner was not asked, because the next trial was proposed before. There the best
/// trial stays, unless Gait RMSE decides and the result is better.
fn at_every_iteration(asked: &[HistoryEntry], labelled: &[(Instant, &Trial)], rmse_decides: bool) -> Vec<HistoryEntry> {
    let Some(first) = asked.first() else { return Vec::new() };
    let mut all: Vec<HistoryEntry> = Vec::with_capacity(labelled.len());
    let mut best = *first;
    for (iteration, (_, trial)) in (1_u32..).zip(labelled).filter(|(iteration, _)| *iteration >= first.iteration) {
        if let Ok(place) = asked.binary_search_by_key(&iteration, |milestone| milestone.iteration) {
            best = asked[place];
        } else if rmse_decides
            && trial.state == TrialState::Converged
            && let (Some(new), Some(old)) = (trial.gait_rmse_rad, best.gait_rmse_rad)
            && new < old
        {
            best = HistoryEntry {
                trial_id: trial.id,
                number: trial.number,
                gait_rmse_rad: trial.gait_rmse_rad,
                cost_of_transport: trial.cost_of_transport,
                ..best
            };
        }
        all.push(HistoryEntry { iteration, ..best });
    }
    all
}

/// The history from the stored proposals alone, without the learner. Assumes that trials ran one at a time.
pub fn known(snapshot: &StudySnapshot) -> Vec<HistoryEntry> {
    let by_id: HashMap<TrialId, &Trial> = snapshot.trials.iter().map(|trial| (trial.id, trial)).collect();
    let best_before = |trial: &Trial| {
        let best = by_id.get(&trial.best_before?).filter(|best| best.state == TrialState::Converged)?;
        Some(HistoryEntry {
            iteration: trial.number - 1,
            trial_id: best.id,
            number: best.number,
            gait_rmse_rad: best.gait_rmse_rad,
            cost_of_transport: best.cost_of_transport,
        })
    };
    snapshot.trials.iter().filter_map(best_before).collect()
}
