//! Derivatives of the results of a gait along a direction of its variables.

use crate::gait::Gait;
use crate::gait_problem::{GaitProblem, GaitProgram, gait_of};
use crate::solve::GaitResults;
use interior_point::Sensitivity;
use serde::Serialize;

/// Largest change of a scaled variable in the differences. The results are smooth functions of the variables, except where
/// two nodes share the peak of a joint.
const MAX_CHANGE: f64 = 1e-5;

/// Derivatives of the results with respect to a tuned bound.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ResultDerivatives {
    /// Derivative of the objective.
    pub objective: f64,
    /// Derivative of the mechanical cost of transport.
    pub cost_of_transport: f64,
    /// Derivative of Gait RMSE, rad per unit of the bound.
    pub gait_rmse_rad: f64,
    /// Derivative of the mean walking speed, m/s per unit of the bound.
    pub speed_m_s: f64,
    /// Derivatives of the largest angle over all nodes, rad per unit of the bound, for torso, hip_L, knee_L, ankle_L,
    /// hip_R, knee_R and ankle_R in this order.
    pub largest_angles_rad: [f64; 7],
    /// Derivatives of the smallest angle over all nodes, in the order of the largest angles, rad per unit of the bound.
    pub smallest_angles_rad: [f64; 7],
}

impl ResultDerivatives {
    /// The derivatives along a sensitivity of the point `x`.
    pub(super) fn along(problem: &GaitProblem, program: &GaitProgram, x: &[f64], sensitivity: &Sensitivity) -> Self {
        let direction = &sensitivity.point.x;
        let largest = direction.iter().fold(0.0, |most: f64, change| most.max(change.abs()));
        if largest == 0.0 {
            return Self::zero();
        }
        let step = MAX_CHANGE / largest;
        let at = |step: f64| {
            let moved: Vec<f64> = x.iter().zip(direction).map(|(x, change)| x + step * change).collect();
            let gait = gait_of(problem, program, &moved);
            (GaitResults::of_well_formed(&gait, &program.model, &problem.reference), extreme_angles(&gait))
        };
        let ((more, more_angles), (less, less_angles)) = (at(step), at(-step));
        let rate = |more: f64, less: f64| (more - less) / (2.0 * step);
        let angles = |which: usize| std::array::from_fn(|i| rate(more_angles[which][i], less_angles[which][i]));
        Self {
            objective: sensitivity.objective,
            cost_of_transport: rate(more.cost_of_transport, less.cost_of_transport),
            gait_rmse_rad: rate(more.gait_rmse_rad, less.gait_rmse_rad),
            speed_m_s: rate(more.speed_m_s, less.speed_m_s),
            largest_angles_rad: angles(0),
            smallest_angles_rad: angles(1),
        }
    }

    fn zero() -> Self {
        Self {
            objective: 0.0,
            cost_of_transport: 0.0,
            gait_rmse_rad: 0.0,
            speed_m_s: 0.0,
            largest_angles_rad: [0.0; 7],
            smallest_angles_rad: [0.0; 7],
        }
    }
}

/// Largest and smallest angle of each joint and of the torso over the nodes, rad.
fn extreme_angles(gait: &Gait) -> [[f64; 7]; 2] {
    let mut extremes = [[f64::NEG_INFINITY; 7], [f64::INFINITY; 7]];
    for q in gait.domains.iter().flat_map(|domain| &domain.q) {
        for i in 0..7 {
            extremes[0][i] = extremes[0][i].max(q[2 + i]);
            extremes[1][i] = extremes[1][i].min(q[2 + i]);
        }
    }
    extremes
}
