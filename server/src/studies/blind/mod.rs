//! Blind comparisons: the server draws who is shown what in which order, stores it, and keeps it to itself.
//!
//! A rater sees a token and two motions. Order is balanced by permuted blocks of four; some pairs are repeats with
//! sides swapped, some show the same gait twice, and neither is heard by the learner.

mod draw;
mod figures;
mod hold;
mod rater;

pub use draw::{Drawn, draw};
pub use figures::{RaterFigures, Share, figures};
pub use rater::{Answered, RaterAnswer, answer, next, take_back, unblind};
pub(crate) use rater::{can_be_taken_back, own};
