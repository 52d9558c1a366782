//! Blind comparisons: the server draws who is shown what in which order, stores it, and keeps it to itself.
//!
//! A rater sees a token and two motions. Order is balanced by permuted blocks of four; some pairs are repeats with
//! sides swapped, some show the same gait twice, and neither is heard by the learner.

mod draw;
mod figures;
mod rater;

pub use draw::{Drawn, draw};
pub use figures::{RaterFigures, Share, figures};
pub use rater::{Answered, RaterAnswer, answer, next, take_back, unblind};
pub(crate) use rater::{can_be_taken_back, own};

use crate::store::TrialId;
use crate::store::presentations::{Presentation, Said};

/// Trials that a rater called unsafe: nobody is shown them again.
pub fn unsafe_trials(presentations: &[Presentation]) -> Vec<TrialId> {
    let mut found = Vec::new();
    for shown in presentations {
        match shown.answer {
            Some(Said::UnsafeFirst) => found.push(shown.shown_first),
            Some(Said::UnsafeSecond) => found.push(shown.shown_second),
            Some(Said::UnsafeBoth) => found.extend([shown.shown_first, shown.shown_second]),
            _ => {}
        }
    }
    found
}

/// Pairs of which a rater could not tell which is better: asked, and not asked again.
pub fn skipped_pairs(presentations: &[Presentation]) -> Vec<(TrialId, TrialId)> {
    let skipped = presentations.iter().filter(|shown| shown.answer == Some(Said::CannotTell));
    skipped.map(|shown| (shown.shown_first, shown.shown_second)).collect()
}
