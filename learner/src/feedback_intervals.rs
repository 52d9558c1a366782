//! The interval likelihood of each kind of feedback: label, preference, suggestion, and no difference.

use crate::interval_likelihood::Interval;
use crate::settings::LearnerSettings;

impl LearnerSettings {
    /// The interval of the difference between the better and the other action.
    pub(crate) fn preference_interval(&self) -> Interval {
        Interval { low: 0.0, high: f64::INFINITY, noise: self.preference_noise }
    }

    /// The interval of the difference between the suggested action and the original one.
    pub(crate) fn suggestion_interval(&self) -> Interval {
        Interval { low: 0.0, high: f64::INFINITY, noise: self.coactive_noise }
    }

    /// The interval of the difference between two actions of which neither is better.
    pub(crate) fn no_difference_interval(&self) -> Interval {
        Interval { low: -self.no_difference_width, high: self.no_difference_width, noise: self.no_difference_noise }
    }

    /// The interval of utilities of a category.
    pub(crate) fn label_interval(&self, category: usize) -> Interval {
        let bounds = &self.ordinal_thresholds;
        let low = category.checked_sub(1).and_then(|below| bounds.get(below)).copied().unwrap_or(f64::NEG_INFINITY);
        Interval { low, high: bounds.get(category).copied().unwrap_or(f64::INFINITY), noise: self.ordinal_noise }
    }

    /// With separate labels, the interval of feasibility of a category: below or above the lowest threshold.
    pub(crate) fn feasibility_interval(&self, category: usize) -> Interval {
        let lowest = self.label_interval(0);
        if category == 0 { lowest } else { Interval { low: lowest.high, high: f64::INFINITY, ..lowest } }
    }

    /// With separate labels, the interval of utilities of a category above 0. `None` if the category does not inform
    /// the utility.
    pub(crate) fn grade_interval(&self, category: usize) -> Option<Interval> {
        let interval = self.label_interval(category);
        match category {
            0 => None,
            _ if self.categories() < 3 => None,
            1 => Some(Interval { low: f64::NEG_INFINITY, ..interval }),
            _ => Some(interval),
        }
    }
}
