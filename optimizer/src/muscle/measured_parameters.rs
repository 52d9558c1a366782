//! Measured strength, speed, lengths and moment arms of a subject's muscles, which override the published table.

use super::attachment::Joint;
use super::muscle_tendon_units::Muscle;
use serde::{Deserialize, Serialize};

/// Measured values of one kind of muscle, which override the table. Missing fields keep the table's values.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MuscleOverride {
    /// Maximum isometric force, N.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_force_n: Option<f64>,
    /// Maximum shortening speed, optimal fibre lengths per second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_speed: Option<f64>,
    /// Optimal fibre length, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optimal_length_m: Option<f64>,
    /// Tendon slack length, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slack_length_m: Option<f64>,
    /// Largest moment arm at the hip, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hip_lever_m: Option<f64>,
    /// Largest moment arm at the knee, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub knee_lever_m: Option<f64>,
    /// Largest moment arm at the ankle, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ankle_lever_m: Option<f64>,
}

/// A parameter of a kind of muscle.
#[derive(Debug, Clone, Copy)]
pub struct MuscleField {
    /// Name with unit, as in JSON: `max_force_n`.
    pub name: &'static str,
    /// Description with unit.
    pub meaning: &'static str,
    /// Smallest allowed value.
    pub minimum: f64,
    /// Largest allowed value.
    pub maximum: f64,
    /// The override of a subject.
    pub given: fn(&MuscleOverride) -> Option<f64>,
    /// The value of a muscle; `None` if the muscle does not span the joint.
    pub value: fn(&Muscle) -> Option<f64>,
}

const LEVER_RANGE_M: (f64, f64) = (0.005, 0.2);

const fn field(
    name: &'static str,
    meaning: &'static str,
    (minimum, maximum): (f64, f64),
    given: fn(&MuscleOverride) -> Option<f64>,
    value: fn(&Muscle) -> Option<f64>,
) -> MuscleField {
    MuscleField { name, meaning, minimum, maximum, given, value }
}

impl MuscleOverride {
    /// The parameters, in order.
    pub const FIELDS: [MuscleField; 7] = [
        field(
            "max_force_n",
            "maximum isometric force, N",
            (50.0, 20_000.0),
            |g| g.max_force_n,
            |m| Some(m.max_force_n),
        ),
        field(
            "max_speed",
            "maximum shortening speed, optimal fibre lengths per second",
            (2.0, 30.0),
            |g| g.max_speed,
            |m| Some(m.max_speed),
        ),
        field(
            "optimal_length_m",
            "optimal fibre length, m",
            (0.01, 0.3),
            |g| g.optimal_length_m,
            |m| Some(m.optimal_length_m),
        ),
        field(
            "slack_length_m",
            "tendon slack length, m",
            (0.02, 0.8),
            |g| g.slack_length_m,
            |m| Some(m.slack_length_m),
        ),
        field(
            "hip_lever_m",
            "largest moment arm at the hip, m",
            LEVER_RANGE_M,
            |g| g.hip_lever_m,
            |m| lever(m, Joint::Hip),
        ),
        field(
            "knee_lever_m",
            "largest moment arm at the knee, m",
            LEVER_RANGE_M,
            |g| g.knee_lever_m,
            |m| lever(m, Joint::Knee),
        ),
        field(
            "ankle_lever_m",
            "largest moment arm at the ankle, m",
            LEVER_RANGE_M,
            |g| g.ankle_lever_m,
            |m| lever(m, Joint::Ankle),
        ),
    ];

    /// Moment arms, m, by joint.
    pub(super) fn levers(&self) -> [(Joint, Option<f64>); 3] {
        [(Joint::Hip, self.hip_lever_m), (Joint::Knee, self.knee_lever_m), (Joint::Ankle, self.ankle_lever_m)]
    }
}

/// Largest moment arm of a muscle at a joint, m; `None` if the muscle does not span it.
fn lever(muscle: &Muscle, joint: Joint) -> Option<f64> {
    muscle.attachments.iter().flatten().find(|attachment| attachment.joint() == joint).map(|found| found.lever_m)
}
