//! The feedback as observations of utility and feasibility.

use std::collections::HashSet;

use crate::action::ActionIndex;
use crate::feedback::{Feedback, FeedbackLog};
use crate::observations::Observation;
use crate::settings::{Labels, LearnerSettings};

/// The observations in the feedback: those of the utility, and with separate labels those of feasibility.
pub(crate) fn observations(
    log: &FeedbackLog,
    settings: &LearnerSettings,
    infeasible: &HashSet<ActionIndex>,
) -> [Vec<Observation>; 2] {
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
            Feedback::Preference { .. } => settings.preference_interval(),
            Feedback::Suggestion { .. } => settings.suggestion_interval(),
            Feedback::NoDifference { .. } => settings.no_difference_interval(),
        };
        let decided = settings.labels == Labels::Separate
            && minus.is_some_and(|minus| infeasible.contains(&plus) != infeasible.contains(&minus));
        if !decided {
            split[0].push(Observation { plus, minus, interval });
        }
    }
    split
}
