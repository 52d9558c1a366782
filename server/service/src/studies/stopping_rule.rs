//! The stopping rule: a study ends early at its time limit, or when its best action does not change.

use super::snapshot::StudySnapshot;
use gaitwright_store::TrialId;

/// Why a study ends before its trials are used up.
pub(super) fn reason_to_stop(snapshot: &StudySnapshot) -> Option<String> {
    let plan = &snapshot.study.plan;
    let spent: f64 = snapshot.trials.iter().filter_map(|trial| trial.seconds_total).sum();
    if let Some(budget) = plan.solve_seconds_budget
        && spent >= budget
    {
        return Some(format!("The solves took {spent:.0} s in total; the limit is {budget:.0} s."));
    }
    let limit = plan.unchanged_limit? as usize;
    // The best trial at each proposal, newest first.
    let bests: Vec<TrialId> =
        snapshot.trials.iter().rev().filter_map(|trial| trial.best_before).take(limit + 1).collect();
    let same = bests.len() > limit && bests.iter().all(|best| *best == bests[0]);
    same.then(|| match limit {
        1 => "The last result did not change the best action.".to_owned(),
        _ => format!("The best action has not changed over the last {limit} results."),
    })
}
