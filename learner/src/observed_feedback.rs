//! What the feedback says of utility and feasibility: each label, preference, answer of no difference and suggestion as an
//! observation.

use std::collections::HashSet;

use crate::action::ActionIndex;
use crate::feedback::{Feedback, FeedbackLog};
use crate::likelihood::Interval;
use crate::observations::Observation;
use crate::settings::{Labels, LearnerSettings};

/// The observations in the feedback: those of the utility, and with separate labels those of feasibility.
pub(crate) fn observations(
    log: &FeedbackLog,
    settings: &LearnerSettings,
    infeasible: &HashSet<ActionIndex>,
) -> [Vec<Observation>; 2] {
    let above = |noise| Interval { low: 0.0, high: f64::INFINITY, noise };
    let mut split = [Vec::new(), Vec::new()];
    for &feedback in &log.feedback {
        let (plus, minus) = feedback.actions();
        let interval = match feedback {
            Feedback::Label { category, .. } if settings.labels == Labels::Separate => {
                split[1].push(Observation { plus, minus, interval: settings.feasibility_interval(category) });
                let grade = settings.grade_interval(category);
                split[0].extend(grade.map(|interval| Observation { plus, minus, interval }));
                continue;
            }
            Feedback::Label { category, .. } => settings.label_interval(category),
            Feedback::Preference { .. } => above(settings.preference_noise),
            Feedback::Suggestion { .. } => above(settings.coactive_noise),
            Feedback::NoDifference { .. } => Interval {
                low: -settings.no_difference_width,
                high: settings.no_difference_width,
                noise: settings.no_difference_noise,
            },
        };
        let decided = settings.labels == Labels::Separate
            && minus.is_some_and(|minus| infeasible.contains(&plus) != infeasible.contains(&minus));
        if !decided {
            split[0].push(Observation { plus, minus, interval });
        }
    }
    split
}
