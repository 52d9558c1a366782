//! The log as the posterior sees it: points of the grid and what was said about them.

use std::collections::HashMap;

use crate::error::Result;
use crate::feedback::{Feedback, FeedbackLog};
use crate::likelihood::Interval;
use crate::settings::LearnerSettings;
use crate::space::{ActionIndex, SearchSpace};

/// An answer about the utility of one point or the difference of two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Site {
    /// Point with coefficient +1.
    pub(crate) plus: usize,
    /// Point with coefficient -1.
    pub(crate) minus: Option<usize>,
    pub(crate) interval: Interval,
}

impl Site {
    /// The site's functional of a vector over the points.
    pub(crate) fn of(&self, f: &[f64]) -> f64 {
        f[self.plus] - self.minus.map_or(0.0, |m| f[m])
    }
}

/// Points in the order in which answers first speak of them, and the answers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Model {
    pub(crate) points: Vec<ActionIndex>,
    pub(crate) levels: Vec<Vec<usize>>,
    pub(crate) sites: Vec<Site>,
    slots: HashMap<ActionIndex, usize>,
}

impl Model {
    pub(crate) fn of_log(space: &SearchSpace, log: &FeedbackLog, settings: &LearnerSettings) -> Result<Self> {
        log.validate(space, settings.categories())?;
        let mut model = Self::default();
        for &feedback in &log.feedback {
            model.add(space, feedback, settings);
        }
        Ok(model)
    }

    /// Position of an action among the points.
    pub(crate) fn slot(&self, action: ActionIndex) -> Option<usize> {
        self.slots.get(&action).copied()
    }

    fn point(&mut self, space: &SearchSpace, action: ActionIndex) -> usize {
        *self.slots.entry(action).or_insert_with(|| {
            self.points.push(action);
            self.levels.push(space.levels(action));
            self.points.len() - 1
        })
    }

    /// Adds a validated answer.
    fn add(&mut self, space: &SearchSpace, feedback: Feedback, settings: &LearnerSettings) {
        let (first, second) = feedback.actions();
        let plus = self.point(space, first);
        let minus = second.map(|action| self.point(space, action));
        let (low, high, noise) = match feedback {
            Feedback::Label { category, .. } => {
                let bounds = &settings.ordinal_thresholds;
                let low = if category == 0 { f64::NEG_INFINITY } else { bounds[category - 1] };
                (low, bounds.get(category).copied().unwrap_or(f64::INFINITY), settings.ordinal_noise)
            }
            Feedback::Preference { .. } => (0.0, f64::INFINITY, settings.preference_noise),
            Feedback::Tie { .. } => (-settings.tie_width, settings.tie_width, settings.tie_noise),
            Feedback::Suggestion { .. } => (0.0, f64::INFINITY, settings.coactive_noise),
        };
        self.sites.push(Site { plus, minus, interval: Interval { low, high, noise } });
    }
}
