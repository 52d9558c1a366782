//! The ten muscle-tendon units: parameters, attachments, length and moment arms.
//!
//! Parameters are those of the model file of Geyer and Herr 2010 (IEEE TNSRE 18:263). In Geyer's convention, hip and
//! knee are at 180° when straight and the ankle is at 90°; angles increase with extension and plantarflexion. As
//! published, length changes use `rho r0` and torques `r0`, where rho accounts for pennation. Muscle power therefore
//! differs slightly from joint power.

use crate::body::Side;
use std::f64::consts::{FRAC_PI_2, PI};

/// Number of muscles.
pub const MUSCLE_COUNT: usize = 10;

/// Joints that muscles span.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Joint {
    Hip,
    Knee,
    Ankle,
}

impl Joint {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Hip => "hip",
            Self::Knee => "knee",
            Self::Ankle => "ankle",
        }
    }
}

/// The attachment of a muscle at one joint that it spans.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attachment {
    /// Index of the joint angle in q: 3 hip_L, 4 knee_L, 5 ankle_L, 6 hip_R.
    pub coordinate: usize,
    /// Largest moment arm r0, m.
    pub lever_m: f64,
    /// Factor rho of the length change.
    pub rho: f64,
    /// Geyer angle of the largest moment arm, rad; `None` for the constant moment arm at the hip.
    pub angle_of_largest_lever: Option<f64>,
    /// Geyer angle at which the unit has the length l_opt + l_slack, rad.
    pub reference_angle: f64,
    /// +1 for a muscle that extends the joint (increases Geyer's angle), -1 for one that flexes it.
    pub direction: f64,
}

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

/// Length contribution and moment arm of an attachment at a joint angle, with derivatives with respect to the angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttachmentValue {
    /// Contribution to the length of the unit, m.
    pub length: f64,
    /// First derivative, m/rad.
    pub length_first: f64,
    /// Second derivative, m/rad².
    pub length_second: f64,
    /// Lever arm, m: joint torque per newton, positive in flexion and dorsiflexion.
    pub arm: f64,
    /// First derivative, m/rad.
    pub arm_first: f64,
    /// Second derivative, m/rad².
    pub arm_second: f64,
}

impl Attachment {
    /// Length contribution and moment arm at a joint angle in rad, in the convention of the walker.
    #[inline]
    pub fn at(&self, angle: f64) -> AttachmentValue {
        let phi = if self.coordinate == 5 { FRAC_PI_2 - angle } else { PI - angle };
        let scale = self.direction * self.rho * self.lever_m;
        match self.angle_of_largest_lever {
            None => AttachmentValue {
                length: -scale * (phi - self.reference_angle),
                length_first: scale,
                length_second: 0.0,
                arm: -self.direction * self.lever_m,
                arm_first: 0.0,
                arm_second: 0.0,
            },
            Some(largest) => {
                let (s, c) = (phi - largest).sin_cos();
                let arm = -self.direction * self.lever_m;
                AttachmentValue {
                    length: -scale * (s - (self.reference_angle - largest).sin()),
                    length_first: scale * c,
                    length_second: scale * s,
                    arm: arm * c,
                    arm_first: arm * s,
                    arm_second: -arm * c,
                }
            }
        }
    }
}

impl Attachment {
    /// The joint.
    pub(super) fn joint(&self) -> Joint {
        match self.coordinate {
            KNEE_L => Joint::Knee,
            ANKLE_L => Joint::Ankle,
            _ => Joint::Hip,
        }
    }
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

#[allow(clippy::unnecessary_wraps)] // the table's entries are optional
const fn attach(
    coordinate: usize,
    lever_m: f64,
    largest_deg: Option<f64>,
    reference_deg: f64,
    rho: f64,
    direction: f64,
) -> Option<Attachment> {
    Some(Attachment {
        coordinate,
        lever_m,
        rho,
        angle_of_largest_lever: match largest_deg {
            Some(degrees) => Some(degrees * (PI / 180.0)),
            None => None,
        },
        reference_angle: reference_deg * (PI / 180.0),
        direction,
    })
}

const HIP_L: usize = 3;
const KNEE_L: usize = 4;
const ANKLE_L: usize = 5;
const HIP_R: usize = 6;

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
