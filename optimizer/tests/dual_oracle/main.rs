//! The whole gait programme written a second time, over dual numbers.
//!
//! Production derives every Jacobian and Hessian entry by hand. Here the same mathematics is written again from its
//! definition, in the plainest form (chains of links, one body after another, no common factors), generically over
//! `num_dual`: evaluated with plain numbers it checks the values, with first-order duals the Jacobian and the gradient,
//! with hyper-dual numbers the Hessian of the Lagrangian. It shares no formula with production, only the vocabulary of
//! row names (`RowName`), by which the two are matched.
//!
//! | file | what it writes again |
//! |---|---|
//! | `walker` | bodies, kinematics of chains, inverse dynamics body by body |
//! | `domains` | the eight domains: contacts, outputs, targets |
//! | `variables` | the order and the scales of the variables |
//! | `muscles` | muscle table, length, lever arms, curves |
//! | `rows` | every row of the programme |
//! | `objective` | cost of transport, regularisation, tracking |
//! | `comparison` | tests: values, Jacobian, gradient, Hessian against production |
//! | `elements` | property tests: single elements against dual numbers |
//! | `physics` | tests: energy, momentum, statics |

#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

mod comparison;
mod domains;
mod elements;
mod muscles;
mod objective;
mod physics;
mod random;
mod rows;
mod variables;
mod walker;

use num_dual::DualNum;

/// Numbers that the second implementation runs on: `f64`, dual, second-order dual, hyper-dual.
pub(crate) trait Scalar: DualNum<Primitive = f64> + Copy {}
impl<T: DualNum<Primitive = f64> + Copy> Scalar for T {}

/// A constant.
pub(crate) fn constant<D: Scalar>(value: f64) -> D {
    D::from(value)
}
