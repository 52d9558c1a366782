//! The ground of the simulated walks: compliant and dissipative, with regularised Coulomb friction.
//!
//! The normal force is that of Geyer and Herr (2010), which Thatte and Geyer (2016) also use for a transfemoral
//! prosthesis: `k d (1 + d' / v)` for a depth d, where the ground yields 1 cm under body weight and relaxes with at most
//! v = 3 cm/s. It never pulls. Friction is that of their sliding ground, smoothed below their transition speed. Without
//! their stiction spring, a foot under load creeps by some mm/s.

use crate::body::GRAVITY;

/// Depth under body weight, m (Geyer and Herr 2010).
pub(super) const YIELD_M: f64 = 0.01;
/// Largest speed at which the ground relaxes, m/s (Geyer and Herr 2010).
const RELEASE_SPEED_M_S: f64 = 0.03;
/// Coefficient of sliding friction (Geyer and Herr 2010).
const FRICTION: f64 = 0.8;
/// Speed of the transition from stiction to sliding, m/s (Geyer and Herr 2010).
const SLIP_SPEED_M_S: f64 = 0.01;

/// The ground under each contact point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ground {
    stiffness_n_m: f64,
}

/// The forces of the ground on a contact point, N, with derivatives.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct GroundForce {
    pub(super) normal: f64,
    pub(super) normal_by_depth: f64,
    pub(super) normal_by_depth_rate: f64,
    pub(super) friction: f64,
    /// Derivative with respect to the sliding speed for a constant normal force.
    pub(super) friction_by_slip: f64,
    /// Friction per unit of normal force.
    pub(super) friction_by_normal: f64,
}

impl Ground {
    /// The ground for a walker of this mass, which yields `yield_m` under its weight.
    pub(super) fn under(mass_kg: f64, yield_m: f64) -> Self {
        Self { stiffness_n_m: mass_kg * GRAVITY / yield_m }
    }

    /// The forces at a depth in m, its rate, and a sliding speed, both in m/s.
    pub(super) fn force(self, depth: f64, depth_rate: f64, slip: f64) -> GroundForce {
        let damping = 1.0 + depth_rate / RELEASE_SPEED_M_S;
        if depth <= 0.0 || damping <= 0.0 {
            return GroundForce::default();
        }
        let normal = self.stiffness_n_m * depth * damping;
        let speed = slip.hypot(SLIP_SPEED_M_S);
        let friction_by_normal = -FRICTION * slip / speed;
        GroundForce {
            normal,
            normal_by_depth: self.stiffness_n_m * damping,
            normal_by_depth_rate: self.stiffness_n_m * depth / RELEASE_SPEED_M_S,
            friction: normal * friction_by_normal,
            friction_by_slip: -normal * FRICTION * SLIP_SPEED_M_S.powi(2) / speed.powi(3),
            friction_by_normal,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ground_never_pulls_and_friction_stays_within_its_cone() {
        let ground = Ground::under(75.0, YIELD_M);
        for depth in [-0.01, 0.0, 1e-4, 0.01, 0.03] {
            for rate in [-1.0, -0.05, -0.02, 0.0, 0.3] {
                for slip in [-2.0, -0.01, 0.0, 0.003, 1.0] {
                    let force = ground.force(depth, rate, slip);
                    assert!(force.normal >= 0.0);
                    assert!(force.friction.abs() <= FRICTION * force.normal);
                    assert!(force.friction * slip <= 0.0);
                }
            }
        }
    }

    #[test]
    fn derivatives_match_differences() {
        let ground = Ground::under(75.0, YIELD_M);
        let (depth, rate, slip, step) = (0.006, 0.01, 0.004, 1e-7);
        let force = ground.force(depth, rate, slip);
        let by_depth = (ground.force(depth + step, rate, slip).normal - force.normal) / step;
        let by_rate = (ground.force(depth, rate + step, slip).normal - force.normal) / step;
        let by_slip = (ground.force(depth, rate, slip + step).friction - force.friction) / step;
        assert!((by_depth / force.normal_by_depth - 1.0).abs() < 1e-4);
        assert!((by_rate / force.normal_by_depth_rate - 1.0).abs() < 1e-4);
        assert!((by_slip / force.friction_by_slip - 1.0).abs() < 1e-4);
    }
}
