//! Preference-based Bayesian optimisation over a finite grid of actions.
//!
//! A person, or a computed figure of merit, evaluates actions of a [`SearchSpace`] and gives [`Feedback`]: labels,
//! preferences, answers of no difference and suggestions. The learner infers a Gaussian-process posterior over the latent utility
//! ([`posterior`]), proposes the next action ([`propose`]) and the comparisons worth asking ([`proposed_comparisons`],
//! [`proposed_comparison`]), and recommends an action ([`Posterior::best`]).
//!
//! All functions are pure functions of space, log, settings and seed. They do no I/O and read no clock. Equal arguments
//! give bitwise equal results on every machine.
//!
//! ```
//! use gait_learner::*;
//!
//! let dimension = |name: &str| Dimension { name: name.into(), values: vec![0.0, 0.1, 0.2, 0.3], lengthscale: 0.1 };
//! let space = SearchSpace::new(vec![dimension("foot clearance"), dimension("torso lean")])?;
//! let settings = LearnerSettings::of(Method::LineCoSpar);
//! // The person likes 0.2 in both dimensions best.
//! let distance = |a: ActionIndex| space.values(a).iter().map(|x| (x - 0.2).powi(2)).sum::<f64>();
//!
//! let mut log = FeedbackLog::default();
//! for _ in 0..12 {
//!     let action = propose(&space, &log, &[], &settings, 1)?.action;
//!     for comparison in proposed_comparisons(&space, &log, action, &settings)? {
//!         let other = comparison.against;
//!         let (winner, loser) = if distance(action) < distance(other) { (action, other) } else { (other, action) };
//!         log.feedback.push(Feedback::Preference { winner, loser });
//!     }
//!     log.visited.push(action);
//! }
//!
//! let posterior = posterior(&space, &log, &settings)?;
//! let best = posterior.best().ok_or("no action visited")?;
//! let prediction = posterior.predict(best)?;
//! println!("{:?}: utility {:.2} +/- {:.2}", space.values(best), prediction.mean, prediction.standard_deviation);
//! assert!(log.visited.iter().all(|&a| distance(best) <= distance(a)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod acquisition;
mod action;
mod action_moments;
mod comparisons;
mod descriptor_correlations;
mod descriptors;
mod error;
mod excluded;
mod feedback;
mod feedback_intervals;
mod fit;
mod gaussian_process;
mod grid_sample;
mod inference;
mod interval_likelihood;
mod kernel;
mod linalg;
mod observations;
mod observed_feedback;
mod posterior;
mod propose;
mod random;
mod search_space;
mod settings;
mod special_functions;
mod utility_inference;
mod whole_grid;

pub use action::ActionIndex;
pub use comparisons::{
    ComparisonReason, ProposedComparison, proposed_comparison, proposed_comparisons, proposed_comparisons_among,
};
pub use descriptors::ActionDescriptors;
pub use error::LearnerError;
pub use excluded::ExcludedActions;
pub use feedback::{Feedback, FeedbackLog};
pub use interval_likelihood::Link;
pub use posterior::agreement::Agreement;
pub use posterior::main_effects::MainEffect;
pub use posterior::marginals::{Marginal, Slice};
pub use posterior::{Posterior, Prediction};
pub use propose::{Proposal, ProposalReason, propose, propose_batch, propose_outside};
pub use search_space::{Dimension, SearchSpace};
pub use settings::{Inference, Labels, LearnerSettings, Method, Partner, Start};
pub use utility_inference::{Learner, posterior};
