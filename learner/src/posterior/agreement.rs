//! How well the posterior agrees with the feedback that it was computed from.

use serde::{Deserialize, Serialize};

use crate::action::ActionIndex;
use crate::feedback::Feedback;
use crate::likelihood::Interval;
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
    /// Number of ties.
    pub ties: usize,
    /// Ties whose posterior means differ by at most the tie width. With separate labels, not those of a feasible with
    /// an infeasible action.
    pub ties_agreeing: usize,
}

impl Posterior {
    /// Counts the feedback that the posterior agrees with.
    pub fn agreement(&self) -> Agreement {
        let mean = |action: ActionIndex| self.utility.mean(action, &self.space().levels(action));
        let mut agreement = Agreement::default();
        for &feedback in self.feedback() {
            match feedback {
                Feedback::Preference { winner, loser } | Feedback::Suggestion { suggested: winner, over: loser } => {
                    agreement.comparisons += 1;
                    let agrees = match self.decided_by_labels(winner, loser) {
                        Some(converges) => converges == winner,
                        None => mean(winner) > mean(loser),
                    };
                    agreement.comparisons_agreeing += usize::from(agrees);
                }
                Feedback::Tie { a, b } => {
                    agreement.ties += 1;
                    let alike = (mean(a) - mean(b)).abs() <= self.settings().tie_width;
                    agreement.ties_agreeing += usize::from(alike && self.decided_by_labels(a, b).is_none());
                }
                Feedback::Label { action, category } => {
                    let settings = self.settings();
                    let within = |at: f64, interval: Interval| at >= interval.low && at <= interval.high;
                    let agrees = match &self.feasibility {
                        None => within(mean(action), settings.label_interval(category)),
                        Some(process) => {
                            let at = process.mean(action, &self.space().levels(action));
                            let grade = settings.grade_interval(category);
                            within(at, settings.feasibility_interval(category))
                                && grade.is_none_or(|interval| within(mean(action), interval))
                        }
                    };
                    agreement.labels += 1;
                    agreement.labels_agreeing += usize::from(agrees);
                }
            }
        }
        agreement
    }
}
