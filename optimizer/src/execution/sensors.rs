//! The sensors of the prosthesis: a delay line of noisy, quantised samples.
//!
//! AMPRO3 has encoders at knee and ankle, an inertial sensor at the thigh and force sensors under the foot. Their
//! resolution and noise are not published. Encoders of 14 bits are those of the Open-Source Leg (Azocar et al. 2020);
//! their rates come from the motors, through a gear of about 50. The other values are assumptions.

use super::control_period::CONTROL_PERIOD_S;
use super::plant::PlantMotion;
use super::random_stream::RandomStream;
use crate::body::Side;
use std::collections::VecDeque;

/// Resolution of the joint encoders, rad: 14 bits for a turn.
const ANGLE_STEP_RAD: f64 = std::f64::consts::TAU / 16_384.0;
/// Resolution of the joint rates, rad/s: a step of the motor's encoder in a period of the controller.
const RATE_STEP_RAD_S: f64 = ANGLE_STEP_RAD / 50.0 / CONTROL_PERIOD_S;
/// Resolution of the force sensors, N (assumption).
const FORCE_STEP_N: f64 = 1.0;
/// Standard deviations of the noise (assumptions).
const ANGLE_NOISE_RAD: f64 = 5e-4;
const RATE_NOISE_RAD_S: f64 = 0.02;
const THIGH_NOISE_RAD: f64 = 3e-3;
const FORCE_NOISE_N: f64 = 5.0;
/// Standard deviation of the constant error of the thigh angle in a walk, rad: half a degree (assumption).
pub(super) const THIGH_OFFSET_RAD: f64 = 8.7e-3;

/// Measurements of the prosthesis.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SensorReadings {
    /// Forward angle of the thigh from the vertical, rad.
    pub(super) thigh_rad: f64,
    /// Knee and ankle angles, rad.
    pub(super) joints_rad: [f64; 2],
    /// Their rates, rad/s.
    pub(super) joint_rates_rad_s: [f64; 2],
    /// Vertical force on the foot, N.
    pub(super) load_n: f64,
}

impl SensorReadings {
    /// The true values of a motion.
    pub(super) fn exactly(motion: &PlantMotion) -> Self {
        let (q, qd) = (&motion.q, &motion.qd);
        Self {
            thigh_rad: q[6] - q[2],
            joints_rad: [q[7], q[8]],
            joint_rates_rad_s: [qd[7], qd[8]],
            load_n: motion.foot_load(Side::Right),
        }
    }
}

/// The sensors of a simulated walk.
#[derive(Debug, Clone)]
pub(super) struct Sensors {
    delayed: VecDeque<SensorReadings>,
    /// Constant error of the thigh angle, rad, and the source of noise; `None` for exact sensors.
    noise: Option<(f64, RandomStream)>,
}

fn rounded(value: f64, step: f64) -> f64 {
    (value / step).round() * step
}

impl Sensors {
    /// Sensors with a delay of whole periods of the controller, which see the motion `start` until then.
    pub(super) fn new(delay_periods: usize, noise: Option<(f64, RandomStream)>, start: &PlantMotion) -> Self {
        Self { delayed: vec![SensorReadings::exactly(start); delay_periods].into(), noise }
    }

    /// Takes a sample of the motion, and returns the one that arrives now.
    pub(super) fn sample(&mut self, motion: &PlantMotion) -> SensorReadings {
        let mut now = SensorReadings::exactly(motion);
        if let Some((thigh_offset, random)) = &mut self.noise {
            now.thigh_rad += *thigh_offset + THIGH_NOISE_RAD * random.normal();
            for angle in &mut now.joints_rad {
                *angle = rounded(*angle + ANGLE_NOISE_RAD * random.normal(), ANGLE_STEP_RAD);
            }
            for rate in &mut now.joint_rates_rad_s {
                *rate = rounded(*rate + RATE_NOISE_RAD_S * random.normal(), RATE_STEP_RAD_S);
            }
            now.load_n = rounded(now.load_n + FORCE_NOISE_N * random.normal(), FORCE_STEP_N);
        }
        self.delayed.push_back(now);
        self.delayed.pop_front().unwrap_or(now)
    }
}
