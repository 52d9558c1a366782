//! What to ask about an action: comparisons are chosen, not only actions.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::feedback::{Feedback, FeedbackLog};
use crate::posterior::Learner;
use crate::settings::{LearnerSettings, Partner};
use crate::space::{ActionIndex, SearchSpace};

/// Why a comparison is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum QuestionReason {
    /// The other action is one of the last tried, or of the same batch.
    Previous,
    /// The other action is the best so far.
    Incumbent,
    /// The pair was asked before: the two answers tell how consistent answers are.
    Consistency,
}

/// "Which of these two is better?"
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Question {
    /// The action asked about.
    pub action: ActionIndex,
    /// What it is compared with.
    pub against: ActionIndex,
    /// Why.
    pub reason: QuestionReason,
}

/// The earlier actions with which a newly tried one should be compared, the latest first.
///
/// As the settings' partner says: the best one, every one, or, as published, those of the same batch and the last
/// `buffer` ones before that batch. Batches are counted in the log: each `samples_per_iteration` trials are one. Asked
/// after each of them, this compares every pair in a batch and each of its actions with the buffered ones.
///
/// # Errors
/// When a setting is out of range or the log does not fit the space.
pub fn comparisons_to_ask(
    space: &SearchSpace,
    log: &FeedbackLog,
    action: ActionIndex,
    settings: &LearnerSettings,
) -> Result<Vec<Question>> {
    Learner::default().comparisons_to_ask(space, log, action, settings)
}

/// As [`comparisons_to_ask`] where some actions cannot be compared, because there is nothing to show of them.
///
/// They count in their batches; in the buffer, and as the best one, stand the others.
///
/// # Errors
/// As [`comparisons_to_ask`].
pub fn comparisons_to_ask_among(
    space: &SearchSpace,
    log: &FeedbackLog,
    action: ActionIndex,
    settings: &LearnerSettings,
    comparable: impl Fn(ActionIndex) -> bool,
) -> Result<Vec<Question>> {
    let of = Partners::of(settings, &comparable);
    Learner::default().questions(space, log, action, settings, &of)
}

/// Earlier actions to compare with.
struct Partners<'a> {
    which: Partner,
    /// Of the previous ones, how many before the batch.
    buffer: usize,
    /// How many trials are one batch.
    batch: usize,
    /// Whether an action can be compared at all.
    comparable: &'a dyn Fn(ActionIndex) -> bool,
}

impl<'a> Partners<'a> {
    fn of(settings: &LearnerSettings, comparable: &'a dyn Fn(ActionIndex) -> bool) -> Self {
        Self { which: settings.partner, buffer: settings.buffer, batch: settings.samples_per_iteration, comparable }
    }
}

impl Learner {
    /// As [`comparisons_to_ask`].
    ///
    /// # Errors
    /// As [`comparisons_to_ask`].
    pub fn comparisons_to_ask(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        action: ActionIndex,
        settings: &LearnerSettings,
    ) -> Result<Vec<Question>> {
        self.questions(space, log, action, settings, &Partners::of(settings, &|_| true))
    }

    /// The comparisons with a kind of partners, whatever the settings say of these: no belief depends on that.
    fn questions(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        action: ActionIndex,
        settings: &LearnerSettings,
        of: &Partners<'_>,
    ) -> Result<Vec<Question>> {
        space.check(action)?;
        settings.validate()?;
        log.validate(space, settings.categories())?;
        let tried = log.visited.len();
        let end = match log.visited.iter().rposition(|&a| a == action) {
            // Repeated trials: an earlier one is not the one asked about.
            Some(position) if !settings.repeats || position + 1 == tried => position,
            _ => tried,
        };
        let earlier = &log.visited[..end];
        let mut questions: Vec<Question> = Vec::new();
        let mut add = |against, reason| {
            if against != action
                && (of.comparable)(against)
                && !questions.iter().any(|q: &Question| q.against == against)
            {
                questions.push(Question { action, against, reason });
            }
        };
        match of.which {
            Partner::Previous => {
                let (before, batch) = earlier.split_at(end - end % of.batch.max(1));
                let buffered = before.iter().rev().filter(|a| (of.comparable)(**a)).take(of.buffer);
                batch.iter().rev().chain(buffered).for_each(|&a| add(a, QuestionReason::Previous));
            }
            Partner::Every => earlier.iter().rev().for_each(|&a| add(a, QuestionReason::Previous)),
            Partner::Incumbent if earlier.is_empty() => {}
            Partner::Incumbent => {
                let before = FeedbackLog { visited: earlier.to_vec(), feedback: log.feedback.clone() };
                let best = self.posterior(space, &before, settings)?.best_of(of.comparable);
                if let Some(best) = best {
                    add(best, QuestionReason::Incumbent);
                }
            }
        }
        Ok(questions)
    }
}

/// Answered comparisons for each one that is asked again.
const ANSWERS_PER_REPEAT: usize = 8;

/// The next comparison worth asking about the actions already tried, if any.
///
/// Nothing is asked about an action whose last label is the lowest category: nobody can compare what did not converge.
/// Of the others, first the last action against its partners of [`comparisons_to_ask`], then against the action tried
/// before it and the best one, where not answered yet. When all are, one pair in eight is asked again, the oldest that
/// was asked only once: what people answer the second time says how far their answers can be trusted.
///
/// # Errors
/// When a setting is out of range or the log does not fit the space.
pub fn what_to_ask(space: &SearchSpace, log: &FeedbackLog, settings: &LearnerSettings) -> Result<Option<Question>> {
    Learner::default().what_to_ask(space, log, settings)
}

impl Learner {
    /// As [`what_to_ask`].
    ///
    /// # Errors
    /// As [`what_to_ask`].
    pub fn what_to_ask(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        settings: &LearnerSettings,
    ) -> Result<Option<Question>> {
        let failed = log.in_lowest_category(settings.categories());
        let comparable = |action: ActionIndex| !failed.contains(&action);
        let Some(&last) = log.visited.iter().rev().find(|a| comparable(**a)) else { return Ok(None) };
        let pair = |a: ActionIndex, b: ActionIndex| (a.min(b), a.max(b));
        let answered: Vec<(ActionIndex, ActionIndex)> = log
            .feedback
            .iter()
            .filter_map(|feedback| match *feedback {
                Feedback::Preference { winner, loser } => Some(pair(winner, loser)),
                Feedback::Tie { a, b } => Some(pair(a, b)),
                Feedback::Label { .. } | Feedback::Suggestion { .. } => None,
            })
            .collect();
        let mut questions = self.questions(space, log, last, settings, &Partners::of(settings, &comparable))?;
        for which in [Partner::Previous, Partner::Incumbent] {
            let of = Partners { which, buffer: 1, batch: 1, comparable: &comparable };
            questions.extend(self.questions(space, log, last, settings, &of)?);
        }
        if let Some(open) = questions.into_iter().find(|q| !answered.contains(&pair(q.action, q.against))) {
            return Ok(Some(open));
        }
        let times = |asked: &(ActionIndex, ActionIndex)| answered.iter().filter(|a| *a == asked).count();
        let again = answered.iter().enumerate().filter(|&(at, asked)| answered[..at].contains(asked)).count();
        if answered.len() < ANSWERS_PER_REPEAT * (again + 1) {
            return Ok(None);
        }
        let once = answered.iter().find(|asked| times(asked) == 1 && comparable(asked.0) && comparable(asked.1));
        Ok(once.map(|&(action, against)| Question { action, against, reason: QuestionReason::Consistency }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Method;
    use crate::space::Dimension;

    #[test]
    fn questions_come_in_order_and_a_pair_is_repeated() {
        let dimension = Dimension { name: "x".into(), values: (0..30).map(f64::from).collect(), lengthscale: 2.0 };
        let space = SearchSpace::new(vec![dimension]).unwrap();
        let settings = LearnerSettings::default();
        let mut log = FeedbackLog { visited: vec![ActionIndex(3)], feedback: vec![] };
        assert_eq!(what_to_ask(&space, &log, &settings).unwrap(), None);
        let mut reasons = Vec::new();
        let mut learner = Learner::default();
        for action in [9, 5, 12, 7, 20].map(ActionIndex) {
            log.visited.push(action);
            while let Some(question) = what_to_ask(&space, &log, &settings).unwrap() {
                assert_eq!(learner.what_to_ask(&space, &log, &settings).unwrap(), Some(question), "the cache");
                reasons.push(question.reason);
                assert!(reasons.len() < 30, "asks for ever");
                let (a, b) = (question.action, question.against);
                let closer = a.0.abs_diff(8) < b.0.abs_diff(8);
                let (winner, loser) = if closer { (a, b) } else { (b, a) };
                log.feedback.push(Feedback::Preference { winner, loser });
            }
        }
        assert_eq!(reasons[0], QuestionReason::Incumbent);
        assert!(reasons.contains(&QuestionReason::Previous));
        assert_eq!(reasons.iter().filter(|r| **r == QuestionReason::Consistency).count(), 1, "{reasons:?}");
    }

    #[test]
    fn nothing_is_asked_about_an_action_that_did_not_converge() {
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
                    while let Some(question) = what_to_ask(&space, &log, &settings).unwrap() {
                        assert!(!fails(question.action) && !fails(question.against), "{question:?}");
                        log.feedback.push(Feedback::Preference { winner: question.action, loser: question.against });
                        asked += 1;
                        assert!(asked < 100, "asks for ever");
                    }
                }
                assert!(asked >= 6, "{asked}");
            }
        }
        // A label that was corrected counts, not the one before it.
        let [a, b] = [1, 2].map(ActionIndex);
        let labels = [0, 1].map(|category| Feedback::Label { action: a, category });
        let log = FeedbackLog { visited: vec![a, b], feedback: labels.to_vec() };
        let settings = LearnerSettings::default();
        let question = what_to_ask(&space, &log, &settings).unwrap().unwrap();
        assert_eq!((question.action, question.against), (b, a));
        let corrected = FeedbackLog { feedback: labels.into_iter().rev().collect(), ..log };
        assert_eq!(what_to_ask(&space, &corrected, &settings).unwrap(), None);
    }

    #[test]
    fn what_cannot_be_compared_counts_in_its_batch() {
        let dimension = Dimension { name: "x".into(), values: (0..30).map(f64::from).collect(), lengthscale: 2.0 };
        let space = SearchSpace::new(vec![dimension]).unwrap();
        let (partner, repeats) = (Partner::Previous, false);
        let settings =
            LearnerSettings { samples_per_iteration: 3, buffer: 2, partner, repeats, ..LearnerSettings::default() };
        // Batches 0 1 2, 3 4 5, 6 7: of the first two, 1, 4 and 5 cannot be compared.
        let log = FeedbackLog { visited: (0..8).map(ActionIndex).collect(), feedback: Vec::new() };
        let comparable = |action: ActionIndex| ![1, 4, 5].contains(&action.0);
        let against = |action: u64| -> Vec<u64> {
            let asked = comparisons_to_ask_among(&space, &log, ActionIndex(action), &settings, comparable).unwrap();
            asked.iter().map(|question| question.against.0).collect()
        };
        assert_eq!(against(2), [0]);
        assert_eq!(against(3), [2, 0]);
        assert_eq!(against(6), [3, 2]);
        assert_eq!(against(7), [6, 3, 2]);
    }

    #[test]
    fn batches_are_compared_as_published() {
        let dimension = Dimension { name: "x".into(), values: (0..30).map(f64::from).collect(), lengthscale: 2.0 };
        let space = SearchSpace::new(vec![dimension]).unwrap();
        let tried: Vec<ActionIndex> = (0..9).map(|i| ActionIndex(29 - 3 * i)).collect();
        let published = LearnerSettings::published(Method::LineCoSpar);
        for (n, b) in [(1, 1), (1, 2), (3, 0), (3, 1), (3, 2), (4, 1)] {
            let settings = LearnerSettings { samples_per_iteration: n, buffer: b, ..published.clone() };
            let mut asked = Vec::new();
            for (end, &action) in tried.iter().enumerate() {
                let log = FeedbackLog { visited: tried[..end].to_vec(), feedback: Vec::new() };
                let questions = comparisons_to_ask(&space, &log, action, &settings).unwrap();
                // The same when the trial is already in the log.
                let after = FeedbackLog { visited: tried[..=end].to_vec(), feedback: Vec::new() };
                assert_eq!(comparisons_to_ask(&space, &after, action, &settings).unwrap(), questions);
                asked.extend(questions.iter().map(|q| (q.against, q.action)));
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
