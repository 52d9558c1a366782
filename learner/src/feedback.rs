//! Feedback about actions, from people or from a computed figure of merit, and its log.

use std::collections::HashSet;

use serde::{Deserialize, Serialize};

use crate::action::ActionIndex;
use crate::error::{LearnerError, Result};
use crate::search_space::SearchSpace;

/// One piece of feedback. Repeated and contradictory feedback is valid: it is evidence of noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Feedback {
    /// An ordinal category. Category 0 is the worst. With the default single threshold, 0 means not converged and 1
    /// converged.
    Label {
        /// The labelled action.
        action: ActionIndex,
        /// Its category, counted from 0.
        category: usize,
    },
    /// One action is better than another.
    Preference {
        /// The better one.
        winner: ActionIndex,
        /// The worse one.
        loser: ActionIndex,
    },
    /// Two actions feel the same.
    NoDifference {
        /// One action.
        a: ActionIndex,
        /// The other.
        b: ActionIndex,
    },
    /// Coactive feedback: a suggested action would be better than a visited one.
    Suggestion {
        /// The suggested action, visited or not.
        suggested: ActionIndex,
        /// The action that it improves on.
        over: ActionIndex,
    },
}

impl Feedback {
    /// The actions that the feedback is about, in the order in which they enter the model.
    pub fn actions(&self) -> (ActionIndex, Option<ActionIndex>) {
        match *self {
            Self::Label { action, .. } => (action, None),
            Self::Preference { winner, loser } => (winner, Some(loser)),
            Self::NoDifference { a, b } => (a, Some(b)),
            Self::Suggestion { suggested, over } => (suggested, Some(over)),
        }
    }
}

/// Visited actions and feedback, each in order.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeedbackLog {
    /// Visited actions, one entry per trial.
    pub visited: Vec<ActionIndex>,
    /// Feedback, in the order in which it was given.
    pub feedback: Vec<Feedback>,
}

impl FeedbackLog {
    /// The actions whose last label is category 0, if there are several categories.
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

    /// Checks that every action is in the space and every category exists.
    ///
    /// # Errors
    /// The first violation: an action outside the space, an action compared with itself, or an unknown category.
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
