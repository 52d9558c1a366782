//! Chooses the pair that a person is asked to compare next.

use super::identical_gaits::is_same_gait;
use super::snapshot::StudySnapshot;
use super::walkable::{NotWalkable, WalkablePair};
use gait_learner::{ActionIndex, FeedbackLog, LearnerError, proposed_comparisons_among};
use gaitwright_compute::OnPool;
use gaitwright_store::TrialId;
use gaitwright_store::trials::Trial;
use std::collections::HashSet;

/// The comparison that a study currently asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PendingComparison {
    /// No comparison.
    None,
    /// This pair, with the newest gait first.
    Pair(WalkablePair),
    /// A comparison, once the gait of this trial is certified.
    AfterCertificate(TrialId),
}

impl PendingComparison {
    /// The trials of the pair, with the newest gait first.
    pub fn trials(&self) -> Option<(TrialId, TrialId)> {
        match self {
            Self::Pair(pair) => Some(pair.trials()),
            Self::None | Self::AfterCertificate(_) => None,
        }
    }
}

/// The comparison that a study waits for. A study that has ended waits for none, even if an answer was retracted.
///
/// # Errors
/// When the learner cannot work with the log.
pub fn awaited_comparison(pool: &OnPool, snapshot: &StudySnapshot) -> Result<PendingComparison, LearnerError> {
    if snapshot.study.state.has_ended() { Ok(PendingComparison::None) } else { pending_comparison(pool, snapshot) }
}

/// The pair that a person should compare now: the newest converged gait and a different gait that nobody has compared
/// with it. The pair does not depend on when certificates arrive.
///
/// # Errors
/// When the learner cannot work with the log.
pub fn pending_comparison(_: &OnPool, snapshot: &StudySnapshot) -> Result<PendingComparison, LearnerError> {
    let plan = &snapshot.study.plan;
    let log = snapshot.log();
    let may_be_asked = |trial: &&Trial| snapshot.grounds.may_become_walkable(trial);
    let mut candidates: HashSet<ActionIndex> =
        snapshot.trials.iter().filter(may_be_asked).map(|trial| trial.action_index).collect();
    let Some(&newest) = log.visited.iter().rev().find(|action| candidates.contains(action)) else {
        return Ok(PendingComparison::None);
    };
    let Some(own) = snapshot.trial_of(newest) else { return Ok(PendingComparison::None) };
    candidates.retain(|action| {
        *action == newest || !snapshot.trial_of(*action).is_some_and(|other| is_same_gait(own, other))
    });
    // The partner derives from the answers before the newest gait. Otherwise an answer about that gait could change the
    // best one, and with it the comparison.
    let mut before = log.clone();
    before.feedback.retain(|feedback| match feedback.actions() {
        (a, Some(b)) => a != newest && b != newest,
        (_, None) => true,
    });
    let proposed =
        proposed_comparisons_among(&plan.search_space, &before, newest, &plan.learner, |a| candidates.contains(&a))?;
    let open = proposed.into_iter().filter(|c| !is_answered(snapshot, &log, c.action, c.against));
    let mut pairs = open.filter_map(|c| Some((snapshot.trial_of(c.action)?, snapshot.trial_of(c.against)?)));
    let Some((first, second)) = pairs.find(|(a, b)| !snapshot.grounds.safety_reports.is_skipped((a.id, b.id))) else {
        return Ok(PendingComparison::None);
    };
    Ok(match (snapshot.walkable(first), snapshot.walkable(second)) {
        (Ok(a), Ok(b)) => {
            WalkablePair::of((a, first), (b, second)).map_or(PendingComparison::None, PendingComparison::Pair)
        }
        (Err(NotWalkable::NotCertified { id, .. }), _) | (_, Err(NotWalkable::NotCertified { id, .. })) => {
            PendingComparison::AfterCertificate(id)
        }
        _ => PendingComparison::None,
    })
}

/// Whether someone has compared these gaits, whichever actions they had then.
fn is_answered(snapshot: &StudySnapshot, log: &FeedbackLog, a: ActionIndex, b: ActionIndex) -> bool {
    let is_same = |one: ActionIndex, other: ActionIndex| {
        let trials = || Some((snapshot.trial_of(one)?, snapshot.trial_of(other)?));
        one == other || trials().is_some_and(|(one, other)| is_same_gait(one, other))
    };
    log.feedback.iter().any(|feedback| {
        let (first, second) = feedback.actions();
        second.is_some_and(|second| {
            (is_same(first, a) && is_same(second, b)) || (is_same(first, b) && is_same(second, a))
        })
    })
}
