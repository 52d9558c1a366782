//! What to ask about an action: comparisons are chosen, not only actions.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::feedback::FeedbackLog;
use crate::posterior::Learner;
use crate::settings::{LearnerSettings, Partner};
use crate::space::{ActionIndex, SearchSpace};

/// Why a comparison is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum QuestionReason {
    /// The other action is one of the last tried.
    Previous,
    /// The other action is the best so far.
    Incumbent,
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

/// The earlier actions with which a newly tried one should be compared, most informative first.
///
/// LineCoSpar compares with the last `buffer` actions tried before it, the other methods with the best one.
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
            if against != action && !questions.iter().any(|q: &Question| q.against == against) {
                questions.push(Question { action, against, reason });
            }
        };
        match settings.partner {
            Partner::Previous => {
                earlier.iter().rev().take(settings.buffer).for_each(|&a| add(a, QuestionReason::Previous));
            }
            Partner::Every => earlier.iter().rev().for_each(|&a| add(a, QuestionReason::Previous)),
            Partner::Incumbent if earlier.is_empty() => {}
            Partner::Incumbent => {
                let before = FeedbackLog { visited: earlier.to_vec(), feedback: log.feedback.clone() };
                let best = self.posterior(space, &before, settings)?.best();
                if let Some(best) = best {
                    add(best, QuestionReason::Incumbent);
                }
            }
        }
        Ok(questions)
    }
}

/// The next comparison worth asking about the actions already tried, if any: the last action against its partners of
/// [`comparisons_to_ask`], unless already answered.
///
/// # Errors
/// When a setting is out of range or the log does not fit the space.
pub fn what_to_ask(space: &SearchSpace, log: &FeedbackLog, settings: &LearnerSettings) -> Result<Option<Question>> {
    let Some(&last) = log.visited.last() else { return Ok(None) };
    let answered = |question: &Question| {
        log.feedback.iter().any(|feedback| {
            let (first, second) = feedback.actions();
            second.is_some_and(|second| {
                (first, second) == (question.action, question.against)
                    || (second, first) == (question.action, question.against)
            })
        })
    };
    Ok(comparisons_to_ask(space, log, last, settings)?.into_iter().find(|question| !answered(question)))
}
