//! One simulated walk: plant, controllers and disturbance, until the last stride, a fall or a halt.

use super::control_period::CONTROL_PERIOD_S;
use super::human_joints::Human;
use super::planned_stride::PlannedStride;
use super::plant::{AppliedTorques, Plant, PlantMotion};
use super::prosthesis::Prosthesis;
use super::random_disturbances::{Disturbance, PUSH_DURATION_S};
use super::sensors::Sensors;
use crate::body::WalkerModel;
use crate::gait::Gait;
use crate::model_error::ModelError;
use crate::subject::Subject;

/// Steps of the plant in a period of the controller.
pub(super) const PLANT_STEPS: u32 = 2;

/// Hip height below which the walker has fallen, relative to the lowest of the gait.
const MIN_HIP: f64 = 0.8;
/// Torso lean beyond which the walker has fallen, rad.
const MAX_LEAN_RAD: f64 = 1.0;
/// Time without a heel strike after which the walker has halted, in strides.
const MAX_STEP: f64 = 1.5;

/// How a simulated walk ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WalkEnd {
    /// All strides are done.
    Completed,
    /// Hip too low, torso too far from upright, or no motion that the ground allows.
    Fell,
    /// No further step.
    Halted,
}

/// The result of a simulated walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WalkOutcome {
    pub(super) end: WalkEnd,
    /// Completed strides.
    pub(super) strides: u32,
    /// Periods of the controller.
    pub(super) periods: u64,
    /// Periods in which knee and ankle wanted more than their largest torque.
    pub(super) saturated: [u64; 2],
    /// Periods in which knee and ankle wanted to change their torque faster than they can.
    pub(super) rate_limited: [u64; 2],
    /// The motion at the end.
    pub(super) motion: PlantMotion,
}

/// A gait that simulated walks start from.
#[derive(Debug, Clone)]
pub(super) struct SimulatedWalker<'a> {
    gait: &'a Gait,
    plan: PlannedStride,
    /// The walker that the controllers assume.
    model: WalkerModel,
    lowest_hip_m: f64,
    /// Place of the first foothold in the coordinates of the gait, m.
    foothold_m: f64,
    /// Steps of the plant in a period of the controller.
    pub(super) plant_steps: u32,
}

impl<'a> SimulatedWalker<'a> {
    /// The walker of a well-formed gait.
    pub(super) fn new(gait: &'a Gait) -> Result<Self, ModelError> {
        let model = WalkerModel::new(&gait.subject, &gait.device)?;
        let lowest = gait.domains.iter().flat_map(|d| &d.q).map(|q| q[1]).fold(f64::INFINITY, f64::min);
        let toe = model.contact_point(crate::body::FootPoint::Toe, crate::body::Side::Right);
        let foothold_m = toe.chain().position(&gait.domains[0].q[0])[0] - 0.5 * model.right.toe_ahead_m;
        Ok(Self {
            gait,
            plan: PlannedStride::new(gait),
            model,
            lowest_hip_m: MIN_HIP * lowest,
            foothold_m,
            plant_steps: PLANT_STEPS,
        })
    }

    /// Mean step length, m.
    pub(super) fn step_m(&self) -> f64 {
        0.5 * self.gait.stride_length_m
    }

    /// Stride time, s.
    pub(super) fn stride_s(&self) -> f64 {
        self.plan.duration_s
    }

    /// Walks `strides` strides.
    pub(super) fn walk(&self, disturbance: &Disturbance, strides: u32) -> Result<WalkOutcome, ModelError> {
        let Gait { subject, device, settings, domains, .. } = self.gait;
        // The factor keeps the mass in the range of the model, except for rounding.
        let (lightest, heaviest) = Subject::BODY_MASS_RANGE_KG;
        let body_mass_kg = (subject.body_mass_kg * disturbance.mass_factor).clamp(lightest, heaviest);
        let model = WalkerModel::new(&Subject { body_mass_kg, ..*subject }, device)?;
        let plant =
            Plant::new(&model, &disturbance.terrain, disturbance.yield_m, (device.ankle_min_rad, device.ankle_max_rad));
        let mut start = domains[0].q[0];
        start[0] -= self.foothold_m;
        let mut motion = PlantMotion::new(start, domains[0].qd[0].map(|rate| rate * disturbance.speed_factor));
        let mut human = Human::new(&self.plan, &self.model, &settings.limits.joint_torques_n_m(device));
        let mut prosthesis = Prosthesis::new(&self.plan, &self.model, device);
        let mut sensors = Sensors::new(disturbance.delay_periods, disturbance.noise.clone(), &motion);
        let mut outcome = WalkOutcome {
            end: WalkEnd::Completed,
            strides: 0,
            periods: 0,
            saturated: [0; 2],
            rate_limited: [0; 2],
            motion,
        };
        let (mut elapsed_s, mut last_strike_s) = (0.0, 0.0);
        while outcome.strides < strides {
            let strikes = human.control(&motion);
            prosthesis.control(&sensors.sample(&motion));
            if strikes.left || strikes.right {
                last_strike_s = elapsed_s;
                outcome.strides += u32::from(strikes.right);
            }
            for (joint, drive) in prosthesis.drives.iter().enumerate() {
                outcome.saturated[joint] += u64::from(drive.saturated);
                outcome.rate_limited[joint] += u64::from(drive.rate_limited);
            }
            outcome.periods += 1;
            let pushed = (0.0..PUSH_DURATION_S).contains(&(elapsed_s - disturbance.push.start_s));
            let push = if pushed { disturbance.push.impulse_n_s / PUSH_DURATION_S } else { 0.0 };
            let moved = self.period(&plant, motion, &human, &prosthesis, push);
            elapsed_s += CONTROL_PERIOD_S;
            let Some(moved) = moved.filter(|moved| self.is_upright(&plant, moved)) else {
                outcome.end = WalkEnd::Fell;
                break;
            };
            motion = moved;
            if elapsed_s - last_strike_s > MAX_STEP * self.plan.duration_s {
                outcome.end = WalkEnd::Halted;
                break;
            }
        }
        outcome.motion = motion;
        Ok(outcome)
    }

    /// A period of the controller: constant torques of drives and muscles.
    fn period(
        &self,
        plant: &Plant<'_>,
        mut motion: PlantMotion,
        human: &Human<'_>,
        prosthesis: &Prosthesis<'_>,
        push: f64,
    ) -> Option<PlantMotion> {
        let [hip_l, knee_l, ankle_l, hip_r] = human.torques(&motion);
        let [knee_r, ankle_r] = prosthesis.drives.map(|drive| drive.torque_n_m);
        let effort = AppliedTorques { torques: [hip_l, knee_l, ankle_l, hip_r, knee_r, ankle_r], push };
        for _ in 0..self.plant_steps {
            motion = plant.step(&motion, &effort, CONTROL_PERIOD_S / f64::from(self.plant_steps))?;
        }
        Some(motion)
    }

    fn is_upright(&self, plant: &Plant<'_>, motion: &PlantMotion) -> bool {
        let height = motion.q[1] - plant.ground_height(motion);
        height >= self.lowest_hip_m && motion.q[2].abs() <= MAX_LEAN_RAD
    }
}
