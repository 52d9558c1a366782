//! The largest torques and powers of each joint, with the limits of the torques.

use gait_optimizer::Gait;
use gaitwright_charts::gait_charts;

const JOINTS: [&str; 6] = ["Left hip", "Left knee", "Left ankle", "Right hip", "Right knee", "Right ankle"];
/// Index in q of the first joint.
const FIRST: usize = 3;

/// A row of the table. Torques are positive in extension and plantarflexion, as in the charts.
pub(super) struct JointPeaks {
    pub(super) joint: &'static str,
    /// Largest torque in each direction, and their limits, N m/kg: extension, flexion.
    pub(super) torques: [String; 2],
    pub(super) limits: [String; 2],
    /// Largest power, W/kg: generated, absorbed.
    pub(super) powers: [String; 2],
}

impl JointPeaks {
    /// The rows of a gait: the extremes of the curves that the charts draw.
    pub(super) fn of(gait: &Gait) -> Vec<Self> {
        let gait = gait_charts::drawn(gait);
        let mass_kg = gait.subject.body_mass_kg;
        let limits = gait.settings.limits.joint_torques_n_m(&gait.device);
        let per_kg = |value: f64| format!("{:.2}", value.max(0.0) / mass_kg);
        let row = |(joint, name): (usize, &&'static str)| {
            let nodes = || gait.domains.iter().flat_map(|domain| domain.u.iter().zip(&domain.qd));
            let torque = |sign: f64| nodes().map(|(u, _)| sign * u[joint]).fold(0.0, f64::max);
            let power = |sign: f64| nodes().map(|(u, qd)| sign * u[joint] * qd[FIRST + joint]).fold(0.0, f64::max);
            let (low, high) = limits[joint];
            Self {
                joint: name,
                torques: [per_kg(torque(-1.0)), per_kg(torque(1.0))],
                limits: [per_kg(-low), per_kg(high)],
                powers: [per_kg(power(1.0)), per_kg(power(-1.0))],
            }
        };
        JOINTS.iter().enumerate().map(row).collect()
    }
}
