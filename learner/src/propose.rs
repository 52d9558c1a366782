//! Proposals: which action to evaluate next.

use serde::{Deserialize, Serialize};

use crate::acquisition::{eubo, information_gain, line_cospar, thompson};
use crate::action::ActionIndex;
use crate::error::{LearnerError, Result};
use crate::excluded::{ExcludedActions, ForbiddenActions};
use crate::feedback::FeedbackLog;
use crate::posterior::Posterior;
use crate::random::Random;
use crate::search_space::SearchSpace;
use crate::settings::{LearnerSettings, Method, Start};
use crate::utility_inference::Learner;

/// The rule by which an action was chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ProposalReason {
    /// The first action of the study.
    FirstAction,
    /// A uniformly random action, by the method `random`.
    RandomAction,
    /// The highest of a Thompson sample on a line through the best action.
    ThompsonOnLine,
    /// The largest expected utility of the better of it and the best action.
    ExpectedBestUtility,
    /// The highest of a joint sample over the whole grid.
    JointThompson,
    /// The largest mutual information between its feedback and the utility.
    InformationGain,
    /// A uniformly random action, because no line through the best action had a candidate.
    LinesExhausted,
}

/// A proposed action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Proposal {
    /// The action to evaluate.
    pub action: ActionIndex,
    /// The rule by which it was chosen.
    pub reason: ProposalReason,
    /// The best action so far, if any has been visited.
    pub best: Option<ActionIndex>,
}

/// Proposes an action that is not pending. It is also unvisited, unless `settings.repeats` allows LineCoSpar to repeat.
///
/// `pending` are the actions being evaluated. Equal arguments give equal proposals.
///
/// # Errors
/// If a setting is out of range, if the log or a pending action does not fit the space, or if no action is left
/// ([`LearnerError::Exhausted`]).
pub fn propose(
    space: &SearchSpace,
    log: &FeedbackLog,
    pending: &[ActionIndex],
    settings: &LearnerSettings,
    seed: u64,
) -> Result<Proposal> {
    Learner::default().propose(space, log, pending, settings, seed)
}

/// [`propose`], but never an action that is `excluded`, visited or pending, whatever the settings say about repeats.
///
/// # Errors
/// As [`propose`]; [`LearnerError::Exhausted`] also if only excluded actions are left.
pub fn propose_outside(
    space: &SearchSpace,
    log: &FeedbackLog,
    pending: &[ActionIndex],
    excluded: &ExcludedActions,
    settings: &LearnerSettings,
    seed: u64,
) -> Result<Proposal> {
    propose_from(&Learner::default().posterior(space, log, settings)?, pending, Some(excluded), seed)
}

/// Proposes a batch of `settings.samples_per_iteration` distinct actions, or as many as are left.
///
/// # Errors
/// As [`propose`].
pub fn propose_batch(
    space: &SearchSpace,
    log: &FeedbackLog,
    pending: &[ActionIndex],
    settings: &LearnerSettings,
    seed: u64,
) -> Result<Vec<Proposal>> {
    Learner::default().propose_batch(space, log, pending, settings, seed)
}

impl Learner {
    /// [`propose`] with the cache.
    ///
    /// # Errors
    /// As [`propose`].
    pub fn propose(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        pending: &[ActionIndex],
        settings: &LearnerSettings,
        seed: u64,
    ) -> Result<Proposal> {
        propose_from(&self.posterior(space, log, settings)?, pending, None, seed)
    }

    /// [`propose_batch`] with the cache.
    ///
    /// # Errors
    /// As [`propose`].
    pub fn propose_batch(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        pending: &[ActionIndex],
        settings: &LearnerSettings,
        seed: u64,
    ) -> Result<Vec<Proposal>> {
        let posterior = self.posterior(space, log, settings)?;
        let mut pending = pending.to_vec();
        let mut proposals = Vec::new();
        for _ in 0..settings.samples_per_iteration {
            match propose_from(&posterior, &pending, None, seed) {
                Ok(proposal) => {
                    pending.push(proposal.action);
                    proposals.push(proposal);
                }
                Err(LearnerError::Exhausted { .. }) if !proposals.is_empty() => break,
                Err(error) => return Err(error),
            }
        }
        Ok(proposals)
    }
}

/// Without `excluded`, repeats are as the settings say.
fn propose_from(
    posterior: &Posterior,
    pending: &[ActionIndex],
    excluded: Option<&ExcludedActions>,
    seed: u64,
) -> Result<Proposal> {
    let space = posterior.space();
    for &action in pending {
        space.check(action)?;
    }
    let settings = posterior.settings();
    let repeats = settings.repeats && settings.method == Method::LineCoSpar && excluded.is_none();
    let none = ExcludedActions::default();
    let forbidden =
        ForbiddenActions::new(space, posterior.visited().iter().chain(pending).copied(), excluded.unwrap_or(&none));
    let exhausted = LearnerError::Exhausted { actions: space.len() };
    let random = &mut Random::new(seed, (posterior.visited().len() + pending.len()) as u64);
    let Some(best) = posterior.best() else {
        let centre = centre(space)?;
        let at_centre = settings.start == Start::Centre && !forbidden.contains(centre);
        let action = if at_centre { Some(centre) } else { forbidden.random_other(random) };
        return Ok(Proposal { action: action.ok_or(exhausted)?, reason: ProposalReason::FirstAction, best: None });
    };
    let small = space.enumerable().is_ok();
    let (found, reason) = match settings.method {
        Method::LineCoSpar => {
            let found = if repeats {
                line_cospar::visited_or_on_line(posterior, best, pending, random)?
            } else {
                line_cospar::unvisited_on_line(posterior, best, &forbidden, random)?
            };
            if found.is_some() {
                (found, ProposalReason::ThompsonOnLine)
            } else {
                let found = line_cospar::random_fallback(posterior, pending, &forbidden, repeats, random);
                (found, ProposalReason::LinesExhausted)
            }
        }
        Method::Eubo => {
            (eubo::proposal(posterior, best, pending, &forbidden, random), ProposalReason::ExpectedBestUtility)
        }
        Method::Thompson if small => {
            (thompson::over_grid(posterior, &forbidden, random)?, ProposalReason::JointThompson)
        }
        Method::Thompson => {
            (thompson::over_candidates(posterior, best, &forbidden, random)?, ProposalReason::JointThompson)
        }
        Method::InformationGain => {
            let found = information_gain::over_candidates(posterior, best, &forbidden, random);
            (found, ProposalReason::InformationGain)
        }
        Method::Random => (forbidden.random_other(random), ProposalReason::RandomAction),
    };
    Ok(Proposal { action: found.ok_or(exhausted)?, reason, best: Some(best) })
}

/// The middle level of every dimension; of two middle levels, the lower one.
fn centre(space: &SearchSpace) -> Result<ActionIndex> {
    space.index_of_levels(&space.shape().iter().map(|n| (n - 1) / 2).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::acquisition::avoidance::Avoidance;
    use crate::feedback::Feedback;
    use crate::search_space::Dimension;
    use crate::settings::Labels;

    fn grid() -> SearchSpace {
        let dimensions = [3, 4, 3]
            .iter()
            .enumerate()
            .map(|(d, &n)| Dimension { name: d.to_string(), values: (0..n).map(f64::from).collect(), lengthscale: 1.0 })
            .collect();
        SearchSpace::new(dimensions).unwrap()
    }

    #[test]
    fn each_action_is_proposed_once_and_the_best_is_found() {
        let space = grid();
        let utility = |a: ActionIndex| {
            let levels = space.levels(a);
            -(levels[0] as f64 - 1.0).powi(2) - (levels[1] as f64 - 2.0).powi(2) - (levels[2] as f64).powi(2)
        };
        for method in [Method::LineCoSpar, Method::Eubo, Method::Thompson, Method::InformationGain, Method::Random] {
            let settings = LearnerSettings { repeats: false, ..LearnerSettings::of(method) };
            let mut log = FeedbackLog::default();
            for trial in 0..space.len() {
                let proposal = propose(&space, &log, &[], &settings, 5).unwrap();
                assert_eq!(proposal, propose(&space, &log, &[], &settings, 5).unwrap());
                assert!(!log.visited.contains(&proposal.action), "{method:?} repeats at {trial}");
                for against in comparisons(&space, &log, proposal.action, &settings) {
                    let (a, b) = (proposal.action, against);
                    let (winner, loser) = if utility(a) > utility(b) { (a, b) } else { (b, a) };
                    if utility(a) == utility(b) {
                        log.feedback.push(Feedback::NoDifference { a, b });
                    } else {
                        log.feedback.push(Feedback::Preference { winner, loser });
                    }
                }
                log.visited.push(proposal.action);
            }
            assert!(matches!(propose(&space, &log, &[], &settings, 5), Err(LearnerError::Exhausted { .. })));
            let best = crate::utility_inference::posterior(&space, &log, &settings).unwrap().best().unwrap();
            assert_eq!(space.levels(best), [1, 2, 0], "{method:?}");
        }
    }

    fn comparisons(
        space: &SearchSpace,
        log: &FeedbackLog,
        action: ActionIndex,
        settings: &LearnerSettings,
    ) -> Vec<ActionIndex> {
        let comparisons = crate::comparisons::proposed_comparisons(space, log, action, settings).unwrap();
        comparisons.into_iter().map(|c| c.against).collect()
    }

    #[test]
    fn methods_propose_outside_the_region_of_avoidance_while_possible() {
        let space = grid();
        // Exactly the actions below the highest level of the second dimension converge.
        let converges = |action: ActionIndex| space.levels(action)[1] < 3;
        for method in [Method::LineCoSpar, Method::Eubo, Method::Thompson, Method::InformationGain] {
            for (labels, repeats) in [
                (Labels::InUtility, false),
                (Labels::Separate, false),
                (Labels::InUtility, true),
                (Labels::Separate, true),
            ] {
                let settings =
                    LearnerSettings { labels, repeats, avoidance: Some(-0.3), ..LearnerSettings::of(method) };
                let mut log = FeedbackLog::default();
                for action in (0..space.len()).step_by(2).map(ActionIndex) {
                    log.feedback.push(Feedback::Label { action, category: usize::from(converges(action)) });
                    log.visited.push(action);
                }
                let posterior = crate::utility_inference::posterior(&space, &log, &settings).unwrap();
                let avoidance = Avoidance::of(&posterior).unwrap();
                let outside = (0..space.len()).map(ActionIndex).filter(|&a| avoidance.allows(a)).count();
                assert!((1..36).contains(&outside), "{outside} {settings:?}");
                let mut free =
                    (0..space.len()).map(ActionIndex).filter(|a| !log.visited.contains(a) && avoidance.allows(*a));
                assert!(free.next().is_some());
                for seed in 0..20 {
                    let proposal = propose(&space, &log, &[], &settings, seed).unwrap();
                    assert!(avoidance.allows(proposal.action), "{} {settings:?}", proposal.action);
                }
                // If all remaining actions are inside the region, one of them is proposed.
                let pending: Vec<ActionIndex> =
                    (0..space.len()).map(ActionIndex).filter(|&a| avoidance.allows(a)).collect();
                assert!(space.contains(propose(&space, &log, &pending, &settings, 1).unwrap().action));
            }
        }
    }

    #[test]
    fn only_pending_actions_exhaust_the_space_if_repeats_are_allowed() {
        let space = grid();
        let settings = LearnerSettings { samples_per_iteration: 5, ..LearnerSettings::published(Method::LineCoSpar) };
        let all: Vec<ActionIndex> = (0..space.len()).map(ActionIndex).collect();
        let better = |pair: &[ActionIndex]| Feedback::Preference { winner: pair[1], loser: pair[0] };
        for feedback in [Vec::new(), all.windows(2).map(better).collect()] {
            let log = FeedbackLog { visited: all.clone(), feedback };
            let batch = propose_batch(&space, &log, &[], &settings, 3).unwrap();
            let distinct: HashSet<ActionIndex> = batch.iter().map(|p| p.action).collect();
            assert_eq!(distinct.len(), 5);
            // First one action is not pending, then none.
            let proposal = propose(&space, &log, &all[1..], &settings, 3).unwrap();
            assert_eq!(proposal.action, all[0]);
            assert_eq!(
                propose(&space, &log, &all, &settings, 3),
                Err(LearnerError::Exhausted { actions: space.len() })
            );
        }
    }

    #[test]
    fn excluded_actions_are_never_proposed() {
        let levels = |a: usize, b: usize, c: usize| vec![a..3, b..4, c..3];
        let dimensions = |more: usize| {
            let long = |d: usize| Dimension {
                name: format!("long {d}"),
                values: (0..200).map(f64::from).collect(),
                lengthscale: 20.0,
            };
            [grid().dimensions().to_vec(), (0..more).map(long).collect()].concat()
        };
        for method in [Method::LineCoSpar, Method::Eubo, Method::Thompson, Method::InformationGain, Method::Random] {
            // With three long dimensions, the grid is too large to be listed.
            for more in [0, 3] {
                let space = SearchSpace::new(dimensions(more)).unwrap();
                let whole = |ranges: Vec<std::ops::Range<usize>>| [ranges, vec![0..200; more]].concat();
                let boxes = vec![whole(levels(1, 0, 0)), whole(levels(0, 2, 0)), whole(levels(0, 0, 2))];
                let excluded = ExcludedActions::new(&space, boxes).unwrap();
                let settings = LearnerSettings { repeats: true, ..LearnerSettings::of(method) };
                let mut log = FeedbackLog::default();
                // Four combinations of the short dimensions are left.
                for trial in 0..4 {
                    let action = propose_outside(&space, &log, &[], &excluded, &settings, 3).unwrap().action;
                    assert!(!excluded.contains(&space.levels(action)), "{method:?} {trial}");
                    assert!(!log.visited.contains(&action), "{method:?} repeats at {trial}");
                    if let Some(&loser) = log.visited.last() {
                        log.feedback.push(Feedback::Preference { winner: action, loser });
                    }
                    log.visited.push(action);
                }
                let exhausted = Err(LearnerError::Exhausted { actions: space.len() });
                if more == 0 {
                    assert_eq!(propose_outside(&space, &log, &[], &excluded, &settings, 3), exhausted, "{method:?}");
                }
                let all = ExcludedActions::new(&space, vec![whole(levels(0, 0, 0))]).unwrap();
                assert_eq!(propose_outside(&space, &log, &[], &all, &settings, 3), exhausted, "{method:?}");
            }
        }
    }

    #[test]
    fn batch_actions_are_distinct_from_each_other_and_from_pending_ones() {
        let space = grid();
        let settings = LearnerSettings { samples_per_iteration: 8, repeats: false, ..LearnerSettings::default() };
        let log = FeedbackLog { visited: vec![ActionIndex(0)], feedback: vec![] };
        let pending = [ActionIndex(3), ActionIndex(7)];
        let mut batch: Vec<_> =
            propose_batch(&space, &log, &pending, &settings, 1).unwrap().into_iter().map(|p| p.action).collect();
        batch.extend(pending);
        batch.push(ActionIndex(0));
        batch.sort_unstable();
        batch.dedup();
        assert_eq!(batch.len(), 11);
    }
}
