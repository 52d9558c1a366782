//! Attachments of the muscles to the joints: contribution to the length of the unit, and moment arm.
//!
//! In Geyer's convention, hip and knee are at 180° when straight and the ankle is at 90°; angles increase with extension
//! and plantarflexion. As published, length changes use `rho r0` and torques `r0`, where rho accounts for pennation.
//! Muscle power therefore differs slightly from joint power.

use std::f64::consts::{FRAC_PI_2, PI};

// Indices of the joint angles in q.
pub(super) const HIP_L: usize = 3;
pub(super) const KNEE_L: usize = 4;
pub(super) const ANKLE_L: usize = 5;
pub(super) const HIP_R: usize = 6;

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

    /// The joint.
    pub(super) fn joint(&self) -> Joint {
        match self.coordinate {
            KNEE_L => Joint::Knee,
            ANKLE_L => Joint::Ankle,
            _ => Joint::Hip,
        }
    }
}

/// An entry of the table, with angles in degrees.
#[allow(clippy::unnecessary_wraps)] // the table's entries are optional
pub(super) const fn attach(
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
