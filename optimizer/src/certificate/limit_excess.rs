//! Violations of C3 and C4 at one instant: how much motion, torques and forces exceed the limits of walker, device,
//! settings and tuned bounds. Zero or negative values satisfy the limit.

use crate::body::{Axis, FootPoint, PointState, Side, WalkerModel};
use crate::gait::Gait;
use crate::walking::{ContactRow, Domain};

/// Ranges of coordinates, velocities and torques.
#[derive(Debug, Clone)]
pub(super) struct AllowedRanges {
    angle: [(f64, f64); 7],
    speed: [f64; 9],
    acceleration: f64,
    torque: [(f64, f64); 6],
    friction: f64,
    contact_force: f64,
}

/// Violations at one instant, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LimitExcess {
    /// Joint and torso angles, rad.
    pub(super) angle: f64,
    /// Velocities, rad/s and m/s.
    pub(super) speed: f64,
    /// Accelerations, rad/s² and m/s².
    pub(super) acceleration: f64,
}

fn beyond(value: f64, (low, high): (f64, f64)) -> f64 {
    (low - value).max(value - high)
}

fn worst(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::NEG_INFINITY, f64::max)
}

impl AllowedRanges {
    /// The limits of a gait.
    pub(super) fn new(gait: &Gait) -> Self {
        let (bounds, limits, device) = (&gait.bounds, &gait.settings.limits, &gait.device);
        let torso = bounds.a6.max(limits.torso_tolerance_rad);
        let hip = bounds.a7.to_radians().min(limits.hip_max_rad);
        let ankle = bounds.a8.to_radians();
        let knee = (limits.knee_min_rad, limits.knee_max_rad);
        let prosthetic_ankle = (device.ankle_min_rad.max(-ankle), device.ankle_max_rad.min(ankle));
        let both = |largest: f64| (-largest, largest);
        let mut speed = [bounds.a1; 9];
        for joint in [7, 8] {
            speed[joint] = bounds.a1.min(device.joint_speed_limit_rad_s);
        }
        Self {
            angle: [both(torso), both(hip), knee, both(ankle), both(hip), knee, prosthetic_ankle],
            speed,
            acceleration: bounds.a2,
            // Repeated here on purpose: the certificate must be independent of the gait problem.
            torque: [
                both(limits.hip_torque_n_m),
                both(limits.knee_torque_n_m),
                (-limits.ankle_plantarflexion_torque_n_m, limits.ankle_dorsiflexion_torque_n_m),
                both(limits.hip_torque_n_m),
                both(device.knee_torque_limit_n_m),
                both(device.ankle_torque_limit_n_m),
            ],
            friction: limits.friction,
            contact_force: limits.contact_force_max_n,
        }
    }

    /// Violations of the motion.
    pub(super) fn motion(&self, q: &[f64; 9], qd: &[f64; 9], qdd: &[f64; 9]) -> LimitExcess {
        LimitExcess {
            angle: worst(q[2..].iter().zip(self.angle).map(|(&value, range)| beyond(value, range))),
            speed: worst(qd.iter().zip(self.speed).map(|(value, largest)| value.abs() - largest)),
            acceleration: worst(qdd.iter().map(|value| value.abs() - self.acceleration)),
        }
    }

    /// Allowed range of each torque, N m.
    pub(super) fn torque_ranges(&self) -> &[(f64, f64); 6] {
        &self.torque
    }

    /// Violation of the torque limits, N m.
    pub(super) fn torque(&self, u: &[f64; 6]) -> f64 {
        worst(u.iter().zip(self.torque).map(|(&value, range)| beyond(value, range)))
    }

    /// Violation of unilateral contact or of the largest force, N.
    pub(super) fn normal_force(&self, rows: &[ContactRow], forces: &[f64]) -> f64 {
        worst(rows.iter().zip(forces).map(|(row, &force)| match row.axis {
            Axis::Z => beyond(force, (0.0, self.contact_force)),
            Axis::X => force.abs() - self.contact_force,
        }))
    }

    /// Friction coefficient of the feet.
    pub(super) fn friction_coefficient(&self) -> f64 {
        self.friction
    }

    /// Violation of the friction cone of a foot, N.
    pub(super) fn friction(&self, rows: &[ContactRow], forces: &[f64]) -> f64 {
        worst([Side::Left, Side::Right].into_iter().filter(|&side| rows.iter().any(|r| r.side == side)).map(|side| {
            let sum = |axis: Axis| -> f64 {
                rows.iter().zip(forces).filter(|(r, _)| r.side == side && r.axis == axis).map(|(_, f)| f).sum()
            };
            sum(Axis::X).abs() - self.friction * sum(Axis::Z)
        }))
    }
}

/// Depth below the ground of the heels and toes that are not in contact, m.
pub(super) fn depth_below_ground(model: &WalkerModel, domain: Domain, state: &PointState) -> f64 {
    let contacts = domain.contact_rows();
    let free = |point: FootPoint, side: Side| !contacts.iter().any(|c| c.point == point && c.side == side);
    worst(
        [
            (FootPoint::Heel, Side::Left),
            (FootPoint::Toe, Side::Left),
            (FootPoint::Heel, Side::Right),
            (FootPoint::Toe, Side::Right),
        ]
        .into_iter()
        .filter(|&(point, side)| free(point, side))
        .map(|(point, side)| -state.contact_position(&model.contact_point(point, side))[1]),
    )
}
