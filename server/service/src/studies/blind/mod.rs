//! Blind comparisons: the server draws pairs and sides for raters, and conceals them until unblinding.
//!
//! A rater sees a code and two motions. A fair coin decides the sides of each pair. The learner uses every answer,
//! also of repeated pairs, so no response of the service can reveal a repeated pair. Answers of raters who could have
//! known the allocation are marked.

mod knowledge;
mod next_pair;
mod rater_answers;
mod rater_reliability;
mod rater_unblinding;
mod repeated_pair;

pub use knowledge::{could_have_known, is_never_blind};
pub use next_pair::{NextPair, next_pair};
pub use rater_answers::{AnswerReceipt, HandedOut, RaterAnswer, answer, next, retract};
pub use rater_answers::{can_be_retracted, own, own_showable_pair, sides_in_words};
pub use rater_reliability::{RaterReliability, Share, of_study as reliability};
pub use rater_unblinding::{UnblindedPair, unblind, unblinded_pairs};
