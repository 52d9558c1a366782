//! Preference-based Bayesian learning over a finite grid of actions.
//!
//! Somebody tries actions of a [`SearchSpace`] and says, of each, how good it was ([`Feedback::Label`]), which of two
//! was better ([`Feedback::Preference`], [`Feedback::Tie`]) or what would have been better
//! ([`Feedback::Suggestion`]). The learner keeps a Gaussian-process belief about the hidden utility
//! ([`posterior`]) and says what to try next ([`propose`]) and what to ask about it ([`what_to_ask`]).
//!
//! Everything here is a pure function of `(space, log, settings, seed)`: no clock, no file, no hidden state. Equal
//! arguments give equal results, bit for bit.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod acquisition;
mod answers;
mod ask;
mod belief;
mod error;
mod feedback;
mod grid;
mod hyperparameters;
mod inference;
mod kernel;
mod likelihood;
mod linalg;
mod math;
mod model;
mod posterior;
mod propose;
mod random;
mod settings;
mod space;
mod state;

pub use answers::{Agreement, BestProbability, Marginal, Slice};
pub use ask::{Question, QuestionReason, comparisons_to_ask, comparisons_to_ask_among, what_to_ask};
pub use error::LearnerError;
pub use feedback::{Feedback, FeedbackLog};
pub use posterior::{Learner, Posterior, Prediction, posterior};
pub use propose::{Proposal, ProposalReason, propose, propose_batch};
pub use settings::{EVERY_TRIAL, Inference, Labels, LearnerSettings, Link, Method, Partner, Start};
pub use space::{ActionIndex, Dimension, SearchSpace};
pub use state::LearnerState;
