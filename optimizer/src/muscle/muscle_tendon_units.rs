//! The ten muscle-tendon units: parameters, attachments and length.
//!
//! Parameters and attachments are those of the model file of Geyer and Herr 2010 (IEEE TNSRE 18:263).

use super::attachment::{ANKLE_L, Attachment, HIP_L, HIP_R, Joint, KNEE_L, attach};
use crate::body::Side;

/// Number of muscles.
pub const MUSCLE_COUNT: usize = 10;

/// A muscle-tendon unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Muscle {
    /// Name: `HAM_L`, ...
    pub name: &'static str,
    /// Leg.
    pub side: Side,
    /// Maximum isometric force F_max, N.
    pub max_force_n: f64,
    /// Maximum shortening speed V, optimal fibre lengths per second.
    pub max_speed: f64,
    /// Optimal fibre length l_opt, m.
    pub optimal_length_m: f64,
    /// Tendon slack length l_slack, m.
    pub slack_length_m: f64,
    /// Attachments; the second is `None` for a monoarticular muscle.
    pub attachments: [Option<Attachment>; 2],
}

impl Muscle {
    /// Whether the muscle spans a joint.
    pub(super) fn spans(&self, joint: Joint) -> bool {
        self.attachments.iter().flatten().any(|attachment| attachment.joint() == joint)
    }

    /// Length of the unit, m.
    pub fn unit_length(&self, q: &[f64; 9]) -> f64 {
        self.optimal_length_m
            + self.slack_length_m
            + self.attachments.iter().flatten().map(|a| a.at(q[a.coordinate]).length).sum::<f64>()
    }
}

const fn muscle(
    name: &'static str,
    side: Side,
    parameters: (f64, f64, f64, f64),
    attachments: [Option<Attachment>; 2],
) -> Muscle {
    let (max_force_n, max_speed, optimal_length_m, slack_length_m) = parameters;
    Muscle { name, side, max_force_n, max_speed, optimal_length_m, slack_length_m, attachments }
}

const HAM: (f64, f64, f64, f64) = (3000.0, 12.0, 0.10, 0.31);
const GLU: (f64, f64, f64, f64) = (1500.0, 12.0, 0.11, 0.13);
const HFL: (f64, f64, f64, f64) = (2000.0, 12.0, 0.11, 0.10);
const GAS: (f64, f64, f64, f64) = (1500.0, 12.0, 0.05, 0.40);
const VAS: (f64, f64, f64, f64) = (6000.0, 12.0, 0.08, 0.23);
const SOL: (f64, f64, f64, f64) = (4000.0, 6.0, 0.04, 0.26);
const TA: (f64, f64, f64, f64) = (800.0, 12.0, 0.06, 0.24);

/// The ten muscles of the published table, in the order of the paper. The right hamstrings have no attachment at the
/// prosthetic knee.
pub const MUSCLES: [Muscle; MUSCLE_COUNT] = [
    muscle(
        "HAM_L",
        Side::Left,
        HAM,
        [attach(HIP_L, 0.08, None, 155.0, 0.7, 1.0), attach(KNEE_L, 0.05, Some(180.0), 180.0, 0.7, -1.0)],
    ),
    muscle("GLU_L", Side::Left, GLU, [attach(HIP_L, 0.10, None, 150.0, 0.5, 1.0), None]),
    muscle("HFL_L", Side::Left, HFL, [attach(HIP_L, 0.10, None, 180.0, 0.5, -1.0), None]),
    muscle(
        "GAS_L",
        Side::Left,
        GAS,
        [attach(ANKLE_L, 0.05, Some(110.0), 80.0, 0.7, 1.0), attach(KNEE_L, 0.05, Some(140.0), 165.0, 0.7, -1.0)],
    ),
    muscle("VAS_L", Side::Left, VAS, [attach(KNEE_L, 0.06, Some(165.0), 125.0, 0.7, 1.0), None]),
    muscle("SOL_L", Side::Left, SOL, [attach(ANKLE_L, 0.05, Some(110.0), 80.0, 0.5, 1.0), None]),
    muscle("TA_L", Side::Left, TA, [attach(ANKLE_L, 0.04, Some(80.0), 110.0, 0.7, -1.0), None]),
    muscle("HAM_R", Side::Right, HAM, [attach(HIP_R, 0.08, None, 155.0, 0.7, 1.0), None]),
    muscle("GLU_R", Side::Right, GLU, [attach(HIP_R, 0.10, None, 150.0, 0.5, 1.0), None]),
    muscle("HFL_R", Side::Right, HFL, [attach(HIP_R, 0.10, None, 180.0, 0.5, -1.0), None]),
];
