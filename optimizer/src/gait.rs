//! A gait: a walking trajectory over one stride, in SI units and radians.

use crate::body::{Axis, FootPoint, Side};
use crate::device::Device;
use crate::settings::GaitSettings;
use crate::subject::Subject;
use crate::tuned_bounds::TunedBounds;
use serde::{Deserialize, Serialize};

pub(crate) mod between_nodes;
mod gait_hash;
mod kept_clearance;
mod phase_progress;
pub mod stick_figure;
mod validation;

pub use kept_clearance::kept_clearance_m;
pub use phase_progress::{PhaseProgress, progress, progress_error_m};

/// Version of the layout of [`Gait`].
pub(crate) const FORMAT_VERSION: u32 = 1;

/// A gait: eight domains over one stride from right heel strike.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gait {
    /// Version of this layout.
    pub format_version: u32,
    /// The subject.
    pub subject: Subject,
    /// The device.
    pub device: Device,
    /// Whether the gait satisfies the muscle constraints C5 to C12.
    pub muscles: bool,
    /// The tuned bounds.
    pub bounds: TunedBounds,
    /// The other settings of the problem.
    pub settings: GaitSettings,
    /// Mean walking speed, m/s.
    pub speed_m_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
    /// Length of the step that ends with left heel strike, m.
    pub right_step_length_m: f64,
    /// Stride time, s.
    pub stride_time_s: f64,
    /// Hip velocity v_hip of the four sequences of domains without impact (DS2_R; DS3_R and SS2_R; DS2_L; DS3_L and
    /// SS2_L), m/s.
    pub hip_velocity_m_s: [f64; 4],
    /// The eight domains in order.
    pub domains: Vec<DomainTrajectory>,
}

/// A component of the ground reaction force on one contact point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ContactRowName {
    /// `heel` or `toe`.
    pub point: FootPoint,
    /// `left` (intact) or `right` (prosthesis).
    pub side: Side,
    /// `x` forward, `z` up.
    pub axis: Axis,
}

/// The trajectory in one domain, at equidistant nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DomainTrajectory {
    /// `DS2_R`, `DS3_R`, `SS2_R`, `SS1_R`, `DS2_L`, ... (R: stance on the prosthesis).
    pub name: String,
    /// Duration, s.
    pub duration_s: f64,
    /// Time of each node from the start of the stride, s.
    pub time_s: Vec<f64>,
    /// Coordinates q at each node: px, pz (m), torso, hip_L, knee_L, ankle_L, hip_R, knee_R, ankle_R (rad).
    pub q: Vec<[f64; 9]>,
    /// Velocities at each node, m/s and rad/s.
    pub qd: Vec<[f64; 9]>,
    /// Accelerations at each node, m/s² and rad/s².
    pub qdd: Vec<[f64; 9]>,
    /// Joint torques at each node: hip_L, knee_L, ankle_L, hip_R, knee_R, ankle_R, N m.
    pub u: Vec<[f64; 6]>,
    /// The components of `contact_forces`, in their order.
    pub contact_rows: Vec<ContactRowName>,
    /// Ground reaction forces at each node, N.
    pub contact_forces: Vec<Vec<f64>>,
    /// Muscle states at each node, in the variant with muscles.
    pub muscles: Option<MuscleTrajectory>,
    /// Coordinates that the virtual constraints drive, as indices into q.
    pub outputs: Vec<usize>,
    /// Bezier coefficients of each output, degree + 1 of them, rad.
    pub bezier: Vec<Vec<f64>>,
    /// Hip position at the start of the domain, where the phase is 0, m.
    pub phase_start_m: f64,
    /// Hip position at the end of the domain, where the phase is 1, m.
    pub phase_end_m: f64,
    /// Impulse of the impact at the start of the domain (DS2 and DS3), N s, in the order of `contact_rows`.
    pub impulse: Option<Vec<f64>>,
}

/// States of the ten muscles (HAM_L, GLU_L, HFL_L, GAS_L, VAS_L, SOL_L, TA_L, HAM_R, GLU_R, HFL_R).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MuscleTrajectory {
    /// Fibre length, in optimal fibre lengths.
    pub fibre_length: Vec<[f64; 10]>,
    /// Fibre velocity, in optimal fibre lengths per second; negative in shortening.
    pub fibre_velocity: Vec<[f64; 10]>,
    /// Activation, 0 to 1.
    pub activation: Vec<[f64; 10]>,
}

impl Gait {
    /// Coordinates at a time of the stride in s, interpolated linearly between nodes. Times are clamped to the stride.
    pub fn coordinates_at(&self, time_s: f64) -> [f64; 9] {
        self.between(time_s, |domain| Some(&domain.q)).unwrap_or([0.0; 9])
    }

    /// Activations of the ten muscles at a time of the stride in s, interpolated linearly between nodes. `None` without
    /// muscles.
    pub fn activations_at(&self, time_s: f64) -> Option<[f64; 10]> {
        self.between(time_s, |domain| domain.muscles.as_ref().map(|muscles| &muscles.activation))
    }

    /// Linear interpolation of a quantity of the nodes.
    fn between<const N: usize>(
        &self,
        time_s: f64,
        values: impl Fn(&DomainTrajectory) -> Option<&Vec<[f64; N]>>,
    ) -> Option<[f64; N]> {
        let mut last = None;
        for domain in &self.domains {
            let values = values(domain)?;
            for k in 1..domain.time_s.len() {
                let (before, after) = (domain.time_s[k - 1], domain.time_s[k]);
                if time_s <= after || after <= before {
                    let share = ((time_s - before) / (after - before)).clamp(0.0, 1.0);
                    return Some(std::array::from_fn(|i| values[k - 1][i] + share * (values[k][i] - values[k - 1][i])));
                }
                last = Some(values[k]);
            }
        }
        last
    }
}
