//! The ten muscle-tendon units: parameters, attachments, length and lever arms.
//!
//! Geyer & Herr 2010 (IEEE TNSRE 18:263), values as in their model file. Geyer's joint angles: hip and knee 180 deg
//! straight, ankle 90 deg; larger = extended / plantarflexed. The length change uses `rho r0`, the torque `r0`, as
//! published (rho stands in for pennation), so muscle power is not exactly joint power.

use super::parameters::Joint;
use crate::gait::Side;
use std::f64::consts::{FRAC_PI_2, PI};

/// Number of muscles.
pub const MUSCLE_COUNT: usize = 10;

/// One joint that a muscle spans.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attachment {
    /// Index of the joint angle in q (3 hip_L, 4 knee_L, 5 ankle_L, 6 hip_R).
    pub coordinate: usize,
    /// Largest lever arm r0, m.
    pub lever_m: f64,
    /// Factor of the length change.
    pub rho: f64,
    /// Geyer angle of the largest lever arm, rad; `None`: constant lever arm (hip).
    pub angle_of_largest_lever: Option<f64>,
    /// Geyer angle at which the unit has length l_opt + l_slack, rad.
    pub reference_angle: f64,
    /// +1 extends the joint (raises Geyer's angle), -1 flexes it.
    pub direction: f64,
}

/// One muscle-tendon unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Muscle {
    /// `HAM_L`, ...
    pub name: &'static str,
    /// Which leg.
    pub side: Side,
    /// Maximum isometric force F_max, N.
    pub max_force_n: f64,
    /// Maximum shortening speed V, optimal lengths per second.
    pub max_speed: f64,
    /// Optimal fibre length l_opt, m.
    pub optimal_length_m: f64,
    /// Tendon slack length l_slack, m.
    pub slack_length_m: f64,
    /// Spanned joints; the second is `None` for a one-joint muscle.
    pub attachments: [Option<Attachment>; 2],
}

/// Length change and lever arm of an attachment at a joint angle, with derivatives by that angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttachmentValue {
    /// Contribution to the unit's length, m.
    pub length: f64,
    /// Its derivative, m/rad.
    pub length_first: f64,
    /// Its second derivative, m/rad².
    pub length_second: f64,
    /// Torque on the model joint (flexion / dorsiflexion positive) per newton, m.
    pub arm: f64,
    /// Its derivative, m/rad.
    pub arm_first: f64,
    /// Its second derivative, m/rad².
    pub arm_second: f64,
}

impl Attachment {
    /// Length contribution and lever arm at joint angle `angle` (model convention, rad).
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
    /// The joint it crosses.
    pub(super) fn joint(&self) -> Joint {
        match self.coordinate {
            KNEE_L => Joint::Knee,
            ANKLE_L => Joint::Ankle,
            _ => Joint::Hip,
        }
    }
}

impl Muscle {
    /// Whether it spans a joint.
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

/// The ten muscles in the paper's order. The right hamstring is attached at the hip only: the prosthetic knee is not
/// driven by it.
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
