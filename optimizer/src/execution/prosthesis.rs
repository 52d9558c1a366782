//! The controller of the prosthesis, as a laboratory runs it at 1 kHz: proportional-derivative tracking of knee and ankle
//! with feed-forward torques.
//!
//! It knows what the prosthesis measures: the angle of its own thigh, knee and ankle, and the force on its own foot. While
//! the foot is on the ground, the linearised hip position over its toe is the phase variable; in swing it is the thigh
//! angle. A heel strike restarts the clock.

use super::actuator::Drive;
use super::control_period::CONTROL_PERIOD_S;
use super::foot_contact::FootContact;
use super::gains::Gains;
use super::planned_stride::PlannedStride;
use super::sensors::SensorReadings;
use super::stride_clock::{StrideClock, StridePhase};
use crate::body::{LegGeometry, WalkerModel};
use crate::device::Device;

/// Gains of knee and ankle in stance.
const STANCE: [Gains; 2] = [Gains::new(450.0, 15.0), Gains::new(300.0, 6.0)];
/// Gains in swing. With the inertias of shank and foot they keep a delay margin of 15 ms: the foot alone is light.
const SWING: [Gains; 2] = [Gains::new(250.0, 12.0), Gains::new(15.0, 0.4)];
/// Time from zero to the largest torque, s (assumption).
const RISE_S: f64 = 0.04;

/// First domain after the lift of the prosthetic foot.
const SWING_STARTS: usize = 6;

/// The controller and the drives.
#[derive(Debug, Clone)]
pub(super) struct Prosthesis<'a> {
    plan: &'a PlannedStride,
    leg: LegGeometry,
    clock: StrideClock,
    foot: FootContact,
    /// Knee and ankle.
    pub(super) drives: [Drive; 2],
}

impl<'a> Prosthesis<'a> {
    /// At the start of a stride.
    pub(super) fn new(plan: &'a PlannedStride, model: &WalkerModel, device: &Device) -> Self {
        let drive = |limit| Drive::new(limit, RISE_S);
        Self {
            plan,
            leg: model.right,
            clock: StrideClock { time_s: 0.0 },
            foot: FootContact::new(true),
            drives: [drive(device.knee_torque_limit_n_m), drive(device.ankle_torque_limit_n_m)],
        }
    }

    /// One period of the controller.
    pub(super) fn control(&mut self, measured: &SensorReadings) {
        self.foot.update(measured.load_n);
        let swing_s = self.plan.start_s(SWING_STARTS);
        let end_s = self.plan.duration_s;
        self.clock.restart_at(0.0, (swing_s, end_s), &mut self.foot);
        let planned = self.plan.at(self.clock.time_s);
        let (q, qd) = (&planned.q, &planned.qd);
        let thigh = (q[6] - q[2], qd[6] - qd[2]);
        let phase = if self.clock.time_s < swing_s {
            let joints = ([q[7], q[8]], [qd[7], qd[8]]);
            StridePhase::of_hip_position(&self.leg, (measured.thigh_rad, measured.joints_rad), thigh, joints)
        } else {
            StridePhase::of_thigh_angle(measured.thigh_rad, thigh)
        };
        self.clock.advance(CONTROL_PERIOD_S, end_s, Some(phase));
        let planned = self.plan.at(self.clock.time_s);
        let gains = if self.foot.loaded { &STANCE } else { &SWING };
        for joint in 0..2 {
            let error = (
                planned.q[7 + joint] - measured.joints_rad[joint],
                planned.qd[7 + joint] - measured.joint_rates_rad_s[joint],
            );
            let command = planned.u[4 + joint] + gains[joint].torque(error);
            self.drives[joint].follow(command, CONTROL_PERIOD_S);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// The delay under which proportional-derivative control of an inertia becomes unstable, s.
    fn delay_margin(gains: Gains, inertia_kg_m2: f64) -> f64 {
        let (stiffness, damping) = (gains.torque((1.0, 0.0)) / inertia_kg_m2, gains.torque((0.0, 1.0)) / inertia_kg_m2);
        // Where |stiffness + damping i w| = w^2, the phase is atan(damping w / stiffness) before -180 degrees.
        let squared = 0.5 * (damping.powi(2) + (damping.powi(4) + 4.0 * stiffness.powi(2)).sqrt());
        let frequency = squared.sqrt();
        (damping * frequency / stiffness).atan() / frequency
    }

    #[test]
    fn swinging_shank_and_foot_tolerate_the_largest_delay() {
        let device = Device::ampro3().unwrap();
        let foot_at = |x: f64, z: f64| device.foot_inertia_kg_m2 + device.foot_mass_kg * x.hypot(z).powi(2);
        let foot = foot_at(device.foot_com_forward_m, device.foot_com_down_m);
        let shank = device.shank_mass_kg
            * device.shank_length_m.powi(2)
            * (device.shank_gyration_fraction.powi(2) + device.shank_com_fraction.powi(2))
            + foot_at(device.foot_com_forward_m, device.shank_length_m + device.foot_com_down_m);
        for (gains, inertia) in SWING.into_iter().zip([shank, foot]) {
            let margin = delay_margin(gains, inertia);
            assert!(margin > 0.015, "{margin}");
        }
    }
}
