//! A second implementation of the gait problem with dual numbers.
//!
//! The crate has hand-written Jacobians and Hessians. These tests implement the same mathematics from its definition,
//! in the simplest form (chains of links, body by body, without common factors), generic over `num_dual`. Plain numbers
//! check values, first-order dual numbers the Jacobian and the gradient, hyper-dual numbers the Hessian of the
//! Lagrangian. The two implementations have only the names of rows (`RowName`) in common.
//!
//! | file | subject |
//! |---|---|
//! | `walker` | bodies, kinematics of chains, inverse dynamics body by body |
//! | `domains` | the eight domains: contacts, outputs, targets |
//! | `variables` | the order and the scales of the variables |
//! | `muscles` | muscle table, length, moment arms, curves |
//! | `rows` | the rows of the gait problem |
//! | `objective` | cost of transport, regularisation, tracking |
//! | `comparison` | tests: values, Jacobian, gradient and Hessian |
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

/// Number types of the second implementation: `f64`, dual, second-order dual, hyper-dual.
pub(crate) trait Scalar: DualNum<Primitive = f64> + Copy {}
impl<T: DualNum<Primitive = f64> + Copy> Scalar for T {}

/// A constant.
pub(crate) fn constant<D: Scalar>(value: f64) -> D {
    D::from(value)
}
