//! Approximate inference: a normal distribution in place of the posterior of the utilities at the points.

mod approximation;
mod expectation_propagation;
mod laplace;
mod site_updates;

pub(crate) use approximation::{Approximate, Approximation};
pub(crate) use expectation_propagation::ExpectationPropagation;
pub(crate) use laplace::Laplace;

#[cfg(test)]
mod against_sampling;
