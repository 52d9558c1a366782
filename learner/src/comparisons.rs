//! Comparisons: which pairs of visited actions to ask about.

use serde::{Deserialize, Serialize};

use crate::action::ActionIndex;
use crate::error::Result;
use crate::feedback::{Feedback, FeedbackLog};
use crate::search_space::SearchSpace;
use crate::settings::{LearnerSettings, Partner};
use crate::utility_inference::Learner;

/// The reason for a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ComparisonReason {
    /// The other action was visited recently, or belongs to the same batch.
    Previous,
    /// The other action is the best action so far.
    Incumbent,
    /// The pair was compared before. Two answers show how consistent answers are.
    Consistency,
}

/// A comparison to ask for: which of two actions is better?
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProposedComparison {
    /// The action in comparison.
    pub action: ActionIndex,
    /// The action that it is compared with.
    pub against: ActionIndex,
    /// The reason for the comparison.
    pub reason: ComparisonReason,
}

/// The comparisons of a new action with earlier ones, according to `settings.partner`, latest first.
///
/// The partners are the best action, every action, or, as published, the other actions of the batch and the last
/// `buffer` actions before it. Each `samples_per_iteration` trials of the log are a batch. Over a batch, these
/// comparisons cover every pair in it, and every pair of a batch and a buffered action.
///
/// # Errors
/// If a setting is out of range, or the log or `action` does not fit the space.
pub fn proposed_comparisons(
    space: &SearchSpace,
    log: &FeedbackLog,
    action: ActionIndex,
    settings: &LearnerSettings,
) -> Result<Vec<ProposedComparison>> {
    Learner::default().proposed_comparisons(space, log, action, settings)
}

/// [`proposed_comparisons`] if only some actions are comparable, for example those with a gait to show.
///
/// The other actions still count as members of their batches. Buffer and best action consist of comparable ones.
///
/// # Errors
/// As [`proposed_comparisons`].
pub fn proposed_comparisons_among(
    space: &SearchSpace,
    log: &FeedbackLog,
    action: ActionIndex,
    settings: &LearnerSettings,
    comparable: impl Fn(ActionIndex) -> bool,
) -> Result<Vec<ProposedComparison>> {
    let of = Partners::of(settings, &comparable);
    Learner::default().comparisons(space, log, action, settings, &of)
}

/// Number of answered comparisons per repeated one.
const ANSWERS_PER_REPEAT: usize = 8;

/// The next comparison to ask about visited actions, if any is worth asking.
///
/// An action whose last label is the lowest category is not comparable, because it did not converge. Unanswered
/// comparisons of the last comparable action come first: with its partners of [`proposed_comparisons`], with the action
/// before it, and with the best action. After these, one comparison per eight answers is a repetition: the oldest pair
/// that was answered once. Repetitions measure the consistency of the answers.
///
/// # Errors
/// If a setting is out of range or the log does not fit the space.
pub fn proposed_comparison(
    space: &SearchSpace,
    log: &FeedbackLog,
    settings: &LearnerSettings,
) -> Result<Option<ProposedComparison>> {
    Learner::default().proposed_comparison(space, log, settings)
}

/// The rule for the partners of an action.
struct Partners<'a> {
    which: Partner,
    /// Number of previous actions before the batch.
    buffer: usize,
    /// Number of trials of a batch.
    batch: usize,
    /// Whether an action can be compared.
    comparable: &'a dyn Fn(ActionIndex) -> bool,
}

impl<'a> Partners<'a> {
    fn of(settings: &LearnerSettings, comparable: &'a dyn Fn(ActionIndex) -> bool) -> Self {
        Self { which: settings.partner, buffer: settings.buffer, batch: settings.samples_per_iteration, comparable }
    }
}

impl Learner {
    /// [`proposed_comparisons`] with the cache.
    ///
    /// # Errors
    /// As [`proposed_comparisons`].
    pub fn proposed_comparisons(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        action: ActionIndex,
        settings: &LearnerSettings,
    ) -> Result<Vec<ProposedComparison>> {
        self.comparisons(space, log, action, settings, &Partners::of(settings, &|_| true))
    }

    /// The comparisons by any rule. The posterior does not depend on the rule, so the cache stays valid.
    fn comparisons(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        action: ActionIndex,
        settings: &LearnerSettings,
        of: &Partners<'_>,
    ) -> Result<Vec<ProposedComparison>> {
        space.check(action)?;
        settings.validate()?;
        log.validate(space, settings.categories())?;
        let tried = log.visited.len();
        let end = match log.visited.iter().rposition(|&a| a == action) {
            // With repeats, only the newest trial can be the one in comparison.
            Some(position) if !settings.repeats || position + 1 == tried => position,
            _ => tried,
        };
        let earlier = &log.visited[..end];
        let mut comparisons: Vec<ProposedComparison> = Vec::new();
        let mut add = |against, reason| {
            if against != action
                && (of.comparable)(against)
                && !comparisons.iter().any(|c: &ProposedComparison| c.against == against)
            {
                comparisons.push(ProposedComparison { action, against, reason });
            }
        };
        match of.which {
            Partner::Previous => {
                let (before, batch) = earlier.split_at(end - end % of.batch.max(1));
                let buffered = before.iter().rev().filter(|a| (of.comparable)(**a)).take(of.buffer);
                batch.iter().rev().chain(buffered).for_each(|&a| add(a, ComparisonReason::Previous));
            }
            Partner::Every => earlier.iter().rev().for_each(|&a| add(a, ComparisonReason::Previous)),
            Partner::Incumbent if earlier.is_empty() => {}
            Partner::Incumbent => {
                let before = FeedbackLog { visited: earlier.to_vec(), feedback: log.feedback.clone() };
                let best = self.posterior(space, &before, settings)?.best_of(of.comparable);
                if let Some(best) = best {
                    add(best, ComparisonReason::Incumbent);
                }
            }
        }
        Ok(comparisons)
    }

    /// [`proposed_comparison`] with the cache.
    ///
    /// # Errors
    /// As [`proposed_comparison`].
    pub fn proposed_comparison(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        settings: &LearnerSettings,
    ) -> Result<Option<ProposedComparison>> {
        let failed = log.in_lowest_category(settings.categories());
        let comparable = |action: ActionIndex| !failed.contains(&action);
        let Some(&last) = log.visited.iter().rev().find(|a| comparable(**a)) else { return Ok(None) };
        let pair = |a: ActionIndex, b: ActionIndex| (a.min(b), a.max(b));
        let answered: Vec<(ActionIndex, ActionIndex)> = log
            .feedback
            .iter()
            .filter_map(|feedback| match *feedback {
                Feedback::Preference { winner, loser } => Some(pair(winner, loser)),
                Feedback::NoDifference { a, b } => Some(pair(a, b)),
                Feedback::Label { .. } | Feedback::Suggestion { .. } => None,
            })
            .collect();
        let mut comparisons = self.comparisons(space, log, last, settings, &Partners::of(settings, &comparable))?;
        for which in [Partner::Previous, Partner::Incumbent] {
            let of = Partners { which, buffer: 1, batch: 1, comparable: &comparable };
            comparisons.extend(self.comparisons(space, log, last, settings, &of)?);
        }
        if let Some(open) = comparisons.into_iter().find(|q| !answered.contains(&pair(q.action, q.against))) {
            return Ok(Some(open));
        }
        let times = |asked: &(ActionIndex, ActionIndex)| answered.iter().filter(|a| *a == asked).count();
        let again = answered.iter().enumerate().filter(|&(at, asked)| answered[..at].contains(asked)).count();
        if answered.len() < ANSWERS_PER_REPEAT * (again + 1) {
            return Ok(None);
        }
        let once = answered.iter().find(|asked| times(asked) == 1 && comparable(asked.0) && comparable(asked.1));
        Ok(once.map(|&(action, against)| ProposedComparison { action, against, reason: ComparisonReason::Consistency }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search_space::Dimension;
    use crate::settings::Method;

    #[test]
    fn comparisons_come_in_order_and_one_in_eight_is_a_repetition() {
        let dimension = Dimension { name: "x".into(), values: (0..30).map(f64::from).collect(), lengthscale: 2.0 };
        let space = SearchSpace::new(vec![dimension]).unwrap();
        let settings = LearnerSettings::default();
        let mut log = FeedbackLog { visited: vec![ActionIndex(3)], feedback: vec![] };
        assert_eq!(proposed_comparison(&space, &log, &settings).unwrap(), None);
        let mut reasons = Vec::new();
        let mut learner = Learner::default();
        for action in [9, 5, 12, 7, 20].map(ActionIndex) {
            log.visited.push(action);
            while let Some(comparison) = proposed_comparison(&space, &log, &settings).unwrap() {
                assert_eq!(
                    learner.proposed_comparison(&space, &log, &settings).unwrap(),
                    Some(comparison),
                    "with the cache"
                );
                reasons.push(comparison.reason);
                assert!(reasons.len() < 30, "the comparisons do not end");
                let (a, b) = (comparison.action, comparison.against);
                let closer = a.0.abs_diff(8) < b.0.abs_diff(8);
                let (winner, loser) = if closer { (a, b) } else { (b, a) };
                log.feedback.push(Feedback::Preference { winner, loser });
            }
        }
        assert_eq!(reasons[0], ComparisonReason::Incumbent);
        assert!(reasons.contains(&ComparisonReason::Previous));
        assert_eq!(reasons.iter().filter(|r| **r == ComparisonReason::Consistency).count(), 1, "{reasons:?}");
    }

    #[test]
    fn actions_that_did_not_converge_are_never_compared() {
        let dimension = Dimension { name: "x".into(), values: (0..30).map(f64::from).collect(), lengthscale: 2.0 };
        let space = SearchSpace::new(vec![dimension]).unwrap();
        let fails = |action: ActionIndex| action.0.is_multiple_of(3);
        for partner in [Partner::Previous, Partner::Incumbent, Partner::Every] {
            for method in [Method::LineCoSpar, Method::Eubo] {
                let settings = LearnerSettings { partner, ..LearnerSettings::of(method) };
                let mut log = FeedbackLog::default();
                let mut asked = 0;
                for action in [3, 4, 6, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18].map(ActionIndex) {
                    log.visited.push(action);
                    log.feedback.push(Feedback::Label { action, category: usize::from(!fails(action)) });
                    while let Some(comparison) = proposed_comparison(&space, &log, &settings).unwrap() {
                        assert!(!fails(comparison.action) && !fails(comparison.against), "{comparison:?}");
                        log.feedback
                            .push(Feedback::Preference { winner: comparison.action, loser: comparison.against });
                        asked += 1;
                        assert!(asked < 100, "the comparisons do not end");
                    }
                }
                assert!(asked >= 6, "{asked}");
            }
        }
        // The last label of an action counts.
        let [a, b] = [1, 2].map(ActionIndex);
        let labels = [0, 1].map(|category| Feedback::Label { action: a, category });
        let log = FeedbackLog { visited: vec![a, b], feedback: labels.to_vec() };
        let settings = LearnerSettings::default();
        let comparison = proposed_comparison(&space, &log, &settings).unwrap().unwrap();
        assert_eq!((comparison.action, comparison.against), (b, a));
        let corrected = FeedbackLog { feedback: labels.into_iter().rev().collect(), ..log };
        assert_eq!(proposed_comparison(&space, &corrected, &settings).unwrap(), None);
    }

    #[test]
    fn incomparable_actions_count_as_members_of_their_batch() {
        let dimension = Dimension { name: "x".into(), values: (0..30).map(f64::from).collect(), lengthscale: 2.0 };
        let space = SearchSpace::new(vec![dimension]).unwrap();
        let (partner, repeats) = (Partner::Previous, false);
        let settings =
            LearnerSettings { samples_per_iteration: 3, buffer: 2, partner, repeats, ..LearnerSettings::default() };
        // Batches 0 1 2, 3 4 5 and 6 7, of which 1, 4 and 5 are not comparable.
        let log = FeedbackLog { visited: (0..8).map(ActionIndex).collect(), feedback: Vec::new() };
        let comparable = |action: ActionIndex| ![1, 4, 5].contains(&action.0);
        let against = |action: u64| -> Vec<u64> {
            let asked = proposed_comparisons_among(&space, &log, ActionIndex(action), &settings, comparable).unwrap();
            asked.iter().map(|comparison| comparison.against.0).collect()
        };
        assert_eq!(against(2), [0]);
        assert_eq!(against(3), [2, 0]);
        assert_eq!(against(6), [3, 2]);
        assert_eq!(against(7), [6, 3, 2]);
    }

    #[test]
    fn published_partners_compare_batches_and_buffer() {
        let dimension = Dimension { name: "x".into(), values: (0..30).map(f64::from).collect(), lengthscale: 2.0 };
        let space = SearchSpace::new(vec![dimension]).unwrap();
        let tried: Vec<ActionIndex> = (0..9).map(|i| ActionIndex(29 - 3 * i)).collect();
        let published = LearnerSettings::published(Method::LineCoSpar);
        for (n, b) in [(1, 1), (1, 2), (3, 0), (3, 1), (3, 2), (4, 1)] {
            let settings = LearnerSettings { samples_per_iteration: n, buffer: b, ..published.clone() };
            let mut asked = Vec::new();
            for (end, &action) in tried.iter().enumerate() {
                let log = FeedbackLog { visited: tried[..end].to_vec(), feedback: Vec::new() };
                let comparisons = proposed_comparisons(&space, &log, action, &settings).unwrap();
                // The log may already have the trial.
                let after = FeedbackLog { visited: tried[..=end].to_vec(), feedback: Vec::new() };
                assert_eq!(proposed_comparisons(&space, &after, action, &settings).unwrap(), comparisons);
                asked.extend(comparisons.iter().map(|q| (q.against, q.action)));
            }
            let mut expected = Vec::new();
            for (start, batch) in (0..).step_by(n).zip(tried.chunks(n)) {
                for (i, &action) in batch.iter().enumerate() {
                    expected.extend(batch[..i].iter().map(|&other| (other, action)));
                    expected.extend(tried[..start].iter().rev().take(b).map(|&other| (other, action)));
                }
            }
            asked.sort_unstable();
            expected.sort_unstable();
            assert_eq!(asked, expected, "n = {n}, b = {b}");
        }
    }
}
