//! The sensitivities of a gait, as they are reported.

use super::active::ActiveConstraint;
use super::result_derivatives::ResultDerivatives;
use crate::solve::SolveError;
use interior_point::SensitivityError;
use serde::Serialize;
use thiserror::Error;

/// The sensitivities of a gait with respect to every tuned bound.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GaitSensitivities {
    /// Mechanical cost of transport of the gait.
    pub cost_of_transport: f64,
    /// One for each tuned bound, in the order of an action.
    pub bounds: Vec<BoundSensitivity>,
}

/// The sensitivity with respect to one tuned bound. Derivatives are per unit of the bound.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoundSensitivity {
    /// Name of the bound.
    pub bound: &'static str,
    /// Its value.
    pub value: f64,
    /// The constraints that it sets and that are active. Empty: small changes of the bound change nothing.
    pub active: Vec<ActiveConstraint>,
    /// Derivatives of the results of the gait.
    pub derivatives: ResultDerivatives,
    /// Values of the bound between which the active constraints stay the same, to first order; `None` if they do for every
    /// value in that direction. Exact for a bound that is not active: there the gait stays as it is.
    pub interval: (Option<f64>, Option<f64>),
    /// Whether a constraint is about to become active or inactive, in which case the derivatives on the two sides
    /// differ.
    pub is_weakly_active: bool,
}

/// Why a gait has no sensitivities.
#[derive(Debug, Error)]
pub enum GaitSensitivityError {
    /// The problem or the warm start is invalid.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The solution is not regular.
    #[error(transparent)]
    Sensitivity(#[from] SensitivityError),
}
