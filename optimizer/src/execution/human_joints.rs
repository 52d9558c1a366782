//! The human joints: both hips, and knee and ankle of the intact leg.
//!
//! This is compliant tracking of the gait with limited bandwidth, not a model of a person: nobody plans a step to regain
//! balance. Torques follow their commands with a first-order lag; the gains are lower than those of a drive; the
//! feed-forward torques lead by the lag, because people anticipate. The hip of a loaded leg keeps the torso upright
//! instead of tracking its own angle, and the hip of a swinging leg tracks the thigh in space, as people do. The person
//! senses their own body without error, so the hip position over the toe of the stance leg tells the time of the stride.

use super::actuator::LaggedJoint;
use super::control_period::CONTROL_PERIOD_S;
use super::foot_contact::FootContact;
use super::gains::Gains;
use super::planned_stride::PlannedStride;
use super::plant::PlantMotion;
use super::stride_clock::{StrideClock, StridePhase};
use crate::body::{Side, WalkerModel};
use crate::walking::phase_gradient;

/// Lag of the torque, s (assumption): between activation (15 ms) and deactivation (50 ms) of muscles.
const LAG_S: f64 = 0.025;
/// Coordinates of the hips, left and right.
const HIPS: [usize; 2] = [3, 6];
/// Coordinates of the intact knee and ankle.
const KNEE_AND_ANKLE: [usize; 2] = [4, 5];

/// Gains of the thigh of a swinging leg.
const THIGH: Gains = Gains::new(250.0, 18.0);
/// Gains of the torso.
const TORSO: Gains = Gains::new(300.0, 40.0);
/// Gains of the intact knee and ankle in stance. The ankle is as stiff as that of walking people (Rouse et al. 2014: 1.5
/// to 6.5 N m/rad for each kg).
const STANCE: [Gains; 2] = [Gains::new(250.0, 15.0), Gains::new(250.0, 12.0)];
/// Gains of the intact knee and ankle in swing.
const SWING: [Gains; 2] = [Gains::new(100.0, 6.0), Gains::new(40.0, 2.0)];
/// Load under which a foot carries only a part of its share, N.
const LIGHT_N: f64 = 50.0;
/// Damping of the joint itself, which has no lag, N m s/rad (assumption).
const PASSIVE_DAMPING_N_M_S_RAD: f64 = 1.0;

/// Smallest planned rate of the hip position that tells the time, m/s.
const MIN_HIP_M_S: f64 = 0.1;
/// First domain of the stance of the left leg.
const LEFT_STANCE: usize = 4;

/// Heel strikes in a period of the controller.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct StrikesInPeriod {
    pub(super) left: bool,
    pub(super) right: bool,
}

/// The human part of the walker.
#[derive(Debug, Clone)]
pub(super) struct Human<'a> {
    plan: &'a PlannedStride,
    /// Gradient of the hip position over the toe in left and in right stance, m/rad.
    gradients: [[f64; 7]; 2],
    clock: StrideClock,
    feet: [FootContact; 2],
    hips: [LaggedJoint; 2],
    knee_and_ankle: [LaggedJoint; 2],
}

impl<'a> Human<'a> {
    /// At the start of a stride, with the torque limits of the six joints in N m.
    pub(super) fn new(plan: &'a PlannedStride, model: &WalkerModel, limits_n_m: &[(f64, f64); 6]) -> Self {
        let joint = |c: usize| {
            let mut joint = LaggedJoint::new(limits_n_m[c - 3], LAG_S);
            joint.torque_n_m = plan.at(0.0).u[c - 3];
            joint
        };
        Self {
            plan,
            gradients: [phase_gradient(model, Side::Left), phase_gradient(model, Side::Right)],
            clock: StrideClock { time_s: 0.0 },
            feet: [FootContact::new(true), FootContact::new(true)],
            hips: HIPS.map(joint),
            knee_and_ankle: KNEE_AND_ANKLE.map(joint),
        }
    }

    /// Notices heel strikes, which start the steps of the plan.
    fn heel_strikes(&mut self, motion: &PlantMotion) -> StrikesInPeriod {
        let [left, right] = &mut self.feet;
        left.update(motion.foot_load(Side::Left));
        right.update(motion.foot_load(Side::Right));
        let (middle_s, end_s) = (self.plan.start_s(LEFT_STANCE), self.plan.duration_s);
        let in_left_stance = self.clock.time_s >= middle_s;
        StrikesInPeriod {
            left: !in_left_stance && self.clock.restart_at(middle_s, (0.0, middle_s), left),
            right: in_left_stance && self.clock.restart_at(0.0, (middle_s, end_s), right),
        }
    }

    /// One period of the controller.
    pub(super) fn control(&mut self, motion: &PlantMotion) -> StrikesInPeriod {
        let strikes = self.heel_strikes(motion);
        let middle_s = self.plan.start_s(LEFT_STANCE);
        let in_left_stance = self.clock.time_s >= middle_s;
        let end_s = if in_left_stance { self.plan.duration_s } else { middle_s - 1e-9 };
        let gradient = &self.gradients[usize::from(!in_left_stance)];
        let along = |q: &[f64; 9]| gradient.iter().zip(&q[2..]).map(|(g, angle)| g * angle).sum::<f64>();
        let planned = self.plan.at(self.clock.time_s);
        let phase = StridePhase {
            measured: along(&motion.q),
            planned: along(&planned.q),
            planned_rate: along(&planned.qd),
            slowest: MIN_HIP_M_S,
        };
        self.clock.advance(CONTROL_PERIOD_S, end_s, Some(phase));
        let planned = self.plan.at(self.clock.time_s);
        let anticipated = self.plan.ahead(self.clock.time_s + LAG_S);
        let (q, qd) = (&motion.q, &motion.qd);
        let error = |c: usize| (planned.q[c] - q[c], planned.qd[c] - qd[c]);
        let upright = TORSO.torque(error(2));
        let loads = [motion.foot_load(Side::Left), motion.foot_load(Side::Right)];
        for (side, (joint, c)) in self.hips.iter_mut().zip(HIPS).enumerate() {
            let share = loads[side] / (loads[0] + loads[1]).max(LIGHT_N);
            // The angle of the thigh in space is the hip angle less the lean of the torso. A loaded hip pushes the torso
            // forwards when it flexes.
            let (hip, torso) = (error(c), error(2));
            let thigh = THIGH.torque((hip.0 - torso.0, hip.1 - torso.1));
            let command = anticipated.u[c - 3] + (1.0 - share) * thigh + share * upright;
            joint.follow(command, CONTROL_PERIOD_S);
        }
        let gains = if self.feet[0].loaded { &STANCE } else { &SWING };
        for (j, (joint, c)) in self.knee_and_ankle.iter_mut().zip(KNEE_AND_ANKLE).enumerate() {
            joint.follow(anticipated.u[c - 3] + gains[j].torque(error(c)), CONTROL_PERIOD_S);
        }
        strikes
    }

    /// Torques of hip_L, knee_L, ankle_L and hip_R, N m.
    pub(super) fn torques(&self, motion: &PlantMotion) -> [f64; 4] {
        let planned = self.plan.at(self.clock.time_s);
        let total = |joint: &LaggedJoint, c: usize| {
            joint.torque_n_m + PASSIVE_DAMPING_N_M_S_RAD * (planned.qd[c] - motion.qd[c])
        };
        let ([hip_l, hip_r], [knee_l, ankle_l]) = (&self.hips, &self.knee_and_ankle);
        [total(hip_l, 3), total(knee_l, 4), total(ankle_l, 5), total(hip_r, 6)]
    }
}
