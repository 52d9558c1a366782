//! What people (or a computed figure of merit) say about actions, and the log of it.

use std::collections::HashSet;

use serde::{Deserialize, Serialize};

use crate::error::{LearnerError, Result};
use crate::space::{ActionIndex, SearchSpace};

/// One answer. Repeated and contradictory answers are information, not errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Feedback {
    /// An ordinal category, 0 the worst. With the default single threshold: 0 not converged, 1 converged.
    Label {
        /// The labelled action.
        action: ActionIndex,
        /// Its category, counted from 0.
        category: usize,
    },
    /// One action was better than another.
    Preference {
        /// The better one.
        winner: ActionIndex,
        /// The worse one.
        loser: ActionIndex,
    },
    /// No difference between two actions was noticed.
    Tie {
        /// One action.
        a: ActionIndex,
        /// The other.
        b: ActionIndex,
    },
    /// Coactive feedback: this would have been better than what was tried.
    Suggestion {
        /// The action suggested (it need not have been visited).
        suggested: ActionIndex,
        /// The action it would improve on.
        over: ActionIndex,
    },
}

impl Feedback {
    /// The actions spoken of, in the order in which they enter the model.
    pub fn actions(&self) -> (ActionIndex, Option<ActionIndex>) {
        match *self {
            Self::Label { action, .. } => (action, None),
            Self::Preference { winner, loser } => (winner, Some(loser)),
            Self::Tie { a, b } => (a, Some(b)),
            Self::Suggestion { suggested, over } => (suggested, Some(over)),
        }
    }
}

/// The record: what was tried and what was said, each in order.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeedbackLog {
    /// Actions tried, in order. A repeated trial may appear twice.
    pub visited: Vec<ActionIndex>,
    /// Answers, in order.
    pub feedback: Vec<Feedback>,
}

impl FeedbackLog {
    /// The actions whose last label is the lowest of several categories.
    pub(crate) fn in_lowest_category(&self, categories: usize) -> HashSet<ActionIndex> {
        let mut lowest = HashSet::new();
        for &feedback in &self.feedback {
            if let Feedback::Label { action, category } = feedback {
                if category == 0 && categories > 1 {
                    lowest.insert(action);
                } else {
                    lowest.remove(&action);
                }
            }
        }
        lowest
    }

    /// Checks that the log speaks of this space and of existing categories only.
    ///
    /// # Errors
    /// At the first action outside the space, comparison of an action with itself, or category that does not exist.
    pub fn validate(&self, space: &SearchSpace, categories: usize) -> Result<()> {
        for &action in &self.visited {
            space.check(action)?;
        }
        for (entry, feedback) in self.feedback.iter().enumerate() {
            let (first, second) = feedback.actions();
            space.check(first)?;
            if let Some(second) = second {
                space.check(second)?;
                if first == second {
                    return Err(LearnerError::SelfComparison { entry, action: first });
                }
            }
            if let Feedback::Label { category, .. } = *feedback
                && category >= categories
            {
                return Err(LearnerError::UnknownCategory { entry, category, categories });
            }
        }
        Ok(())
    }
}
