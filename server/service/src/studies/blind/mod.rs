//! Blind comparisons: the server draws who is shown what on which side, stores it, and keeps it to itself.
//!
//! A rater sees a token and two motions. The side of a gait is a fair coin for each pair. Every answer is heard by the
//! learner, also of a pair that is asked again: no presentation is a secret control that something served could tell from
//! the others. Answers of somebody who could have known which gait is which are recorded as such.

mod draw;
mod figures;
mod knowledge;
mod rater;

pub use draw::{Drawn, draw};
pub use figures::{RaterFigures, Share, figures};
pub use knowledge::{could_have_known, sees_gaits};
pub use rater::{Answered, RaterAnswer, UnblindedPair, answer, next, take_back, unblind};
pub use rater::{can_be_taken_back, own};
