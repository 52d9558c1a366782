//! Parts of the sensitivities of gaits.

use gait_optimizer::sensitivity;
use serde::Serialize;
use utoipa::ToSchema;

/// Constraint that is active at a node or over the stride.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ActiveConstraint {
    /// Domain, node and quantity.
    place: String,
    /// Multiplier of the scaled constraint: decrease of the objective per unit by which the constraint is relaxed.
    multiplier: f64,
}

impl From<sensitivity::ActiveConstraint> for ActiveConstraint {
    fn from(constraint: sensitivity::ActiveConstraint) -> Self {
        let sensitivity::ActiveConstraint { place, multiplier } = constraint;
        Self { place, multiplier }
    }
}

/// Derivatives of the results with respect to a tuned bound.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ResultDerivatives {
    /// Derivative of the objective.
    objective: f64,
    /// Derivative of the mechanical cost of transport.
    cost_of_transport: f64,
    /// Derivative of Gait RMSE, rad per unit of the bound.
    gait_rmse_rad: f64,
    /// Derivative of the mean walking speed, m/s per unit of the bound.
    speed_m_s: f64,
    /// Derivatives of the largest angle over all nodes, rad per unit of the bound, for torso, hip_L, knee_L, ankle_L,
    /// hip_R, knee_R and ankle_R in this order.
    #[schema(value_type = Vec<f64>, min_items = 7, max_items = 7)]
    largest_angles_rad: [f64; 7],
    /// Derivatives of the smallest angle over all nodes, in the order of the largest angles, rad per unit of the bound.
    #[schema(value_type = Vec<f64>, min_items = 7, max_items = 7)]
    smallest_angles_rad: [f64; 7],
}

impl From<sensitivity::ResultDerivatives> for ResultDerivatives {
    fn from(derivatives: sensitivity::ResultDerivatives) -> Self {
        let sensitivity::ResultDerivatives {
            objective,
            cost_of_transport,
            gait_rmse_rad,
            speed_m_s,
            largest_angles_rad,
            smallest_angles_rad,
        } = derivatives;
        Self { objective, cost_of_transport, gait_rmse_rad, speed_m_s, largest_angles_rad, smallest_angles_rad }
    }
}
