//! Sensitivities of a gait with respect to the tuned bounds: what changes, to first order, if a bound moves.
//!
//! The derivative of the primal-dual point comes from one factorisation at the solution
//! ([`interior_point::sensitivities`]). Margins that tighten bounds between nodes are constant: a tightened bound moves with
//! its tuned bound. Derivatives are valid while the active constraints stay the same, which [`BoundSensitivity::interval`]
//! predicts to first order.

mod active_set;
mod bound_sensitivity;
mod program_derivatives;
mod result_derivatives;
mod sensitivity_sentences;

pub use active_set::ActiveConstraint;
use bound_sensitivity::PointSensitivities;
pub use bound_sensitivity::{BoundSensitivity, GaitSensitivities, GaitSensitivityError};
pub use result_derivatives::ResultDerivatives;

use crate::gait_problem::GaitProblem;
use crate::solve::{SolveOptions, WarmStart};
use crate::tuned_bounds::TunedBounds;

/// The sensitivities of the converged gait `solution` of `problem`. `options` are those of its solve.
///
/// # Errors
/// [`GaitSensitivityError`] if the input is invalid or the solution is not regular.
pub fn sensitivities(
    problem: &GaitProblem,
    solution: &WarmStart,
    options: &SolveOptions,
) -> Result<GaitSensitivities, GaitSensitivityError> {
    let points = PointSensitivities::new(problem, solution, options)?;
    let bounds = (0..TunedBounds::COUNT).map(|bound| points.of_bound(problem, solution, bound));
    Ok(GaitSensitivities { cost_of_transport: points.cost_of_transport(problem, solution), bounds: bounds.collect() })
}
