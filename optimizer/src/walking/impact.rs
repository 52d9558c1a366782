//! The plastic impact: velocities after a landing, and contact impulses.

use super::domain_cycle::Domain;
use crate::body::{Axis, InverseDynamics, PointState, WalkerModel};
use nalgebra::{DMatrix, DVector};

/// Velocities after an impact and the impulses of the contact rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Impact {
    /// Velocities, m/s and rad/s.
    pub velocity_after: [f64; 9],
    /// Impulse of each contact row of the new domain, N s.
    pub impulse: Vec<f64>,
}

/// Solves `[M -J^T; J 0] [qd+; Lambda] = [M qd-; 0]` with the contact rows of the domain after the impact. Positions
/// are continuous. `None` if the contact rows are linearly dependent in this posture.
pub fn impact(model: &WalkerModel, opens: Domain, q: &[f64; 9], velocity_before: &[f64; 9]) -> Option<Impact> {
    let mass = InverseDynamics::new(model).mass_matrix(q);
    let rows = opens.contact_rows();
    let order = 9 + rows.len();
    let mut matrix = DMatrix::<f64>::zeros(order, order);
    let mut rhs = DVector::<f64>::zeros(order);
    for i in 0..9 {
        for j in 0..9 {
            matrix[(i, j)] = mass[i][j];
            rhs[i] += mass[i][j] * velocity_before[j];
        }
    }
    for (c, row) in rows.iter().enumerate() {
        let jacobian = model.contact_point(row.point, row.side).chain().jacobian(q);
        let axis = match row.axis {
            Axis::X => 0,
            Axis::Z => 1,
        };
        for i in 0..9 {
            matrix[(i, 9 + c)] = -jacobian[axis][i];
            matrix[(9 + c, i)] = jacobian[axis][i];
        }
    }
    let solution = matrix.lu().solve(&rhs)?;
    let mut velocity_after = [0.0; 9];
    velocity_after.copy_from_slice(&solution.as_slice()[..9]);
    Some(Impact { velocity_after, impulse: solution.as_slice()[9..].to_vec() })
}

/// Kinetic energy, J.
pub fn kinetic_energy(model: &WalkerModel, q: &[f64; 9], qd: &[f64; 9]) -> f64 {
    let momentum = InverseDynamics::without_gravity(model).rows(&PointState::new(q, &[0.0; 9], qd));
    0.5 * momentum.iter().zip(qd).map(|(p, v)| p * v).sum::<f64>()
}
