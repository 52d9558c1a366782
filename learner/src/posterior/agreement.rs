//! How well the posterior agrees with the feedback that it was computed from.

use serde::{Deserialize, Serialize};

use crate::action::ActionIndex;
use crate::feedback::Feedback;
use crate::interval_likelihood::Interval;
use crate::posterior::Posterior;

/// Number of pieces of feedback, and of those that the posterior agrees with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Number of preferences and suggestions.
    pub comparisons: usize,
    /// Comparisons that the posterior means order in the same way. With separate labels, a comparison of a feasible
    /// with an infeasible action agrees if it prefers the feasible one.
    pub comparisons_agreeing: usize,
    /// Number of labels.
    pub labels: usize,
    /// Labels whose category contains the posterior mean. With separate labels, feasibility and grade must both agree.
    pub labels_agreeing: usize,
    /// Number of answers of no difference.
    pub no_difference: usize,
    /// Answers of no difference whose posterior means differ by at most `no_difference_width`. With separate labels, not
    /// those of a feasible with
    /// an infeasible action.
    pub no_difference_agreeing: usize,
}

impl Posterior {
    /// Counts the feedback that the posterior agrees with.
    pub fn agreement(&self) -> Agreement {
        let mut agreement = Agreement::default();
        for &feedback in self.feedback() {
            let (all, agreeing) = match feedback {
                Feedback::Preference { .. } | Feedback::Suggestion { .. } => {
                    (&mut agreement.comparisons, &mut agreement.comparisons_agreeing)
                }
                Feedback::NoDifference { .. } => (&mut agreement.no_difference, &mut agreement.no_difference_agreeing),
                Feedback::Label { .. } => (&mut agreement.labels, &mut agreement.labels_agreeing),
            };
            *all += 1;
            *agreeing += usize::from(self.agrees_with(feedback));
        }
        agreement
    }

    /// Whether the posterior agrees with a piece of feedback, as [`Agreement`] counts it. The actions must be in the space.
    pub fn agrees_with(&self, feedback: Feedback) -> bool {
        let mean = |action: ActionIndex| self.utility.mean(action, &self.space().levels(action));
        let settings = self.settings();
        match feedback {
            Feedback::Preference { winner, loser } | Feedback::Suggestion { suggested: winner, over: loser } => {
                match self.decided_by_labels(winner, loser) {
                    Some(converges) => converges == winner,
                    None => mean(winner) > mean(loser),
                }
            }
            Feedback::NoDifference { a, b } => {
                let alike = (mean(a) - mean(b)).abs() <= settings.no_difference_width;
                alike && self.decided_by_labels(a, b).is_none()
            }
            Feedback::Label { action, category } => {
                let within = |at: f64, interval: Interval| at >= interval.low && at <= interval.high;
                match &self.feasibility {
                    None => within(mean(action), settings.label_interval(category)),
                    Some(process) => {
                        let at = process.mean(action, &self.space().levels(action));
                        let grade = settings.grade_interval(category);
                        within(at, settings.feasibility_interval(category))
                            && grade.is_none_or(|interval| within(mean(action), interval))
                    }
                }
            }
        }
    }
}
