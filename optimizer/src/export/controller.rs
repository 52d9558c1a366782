//! The controller file: the data that the device needs to execute a gait. The file explains its own fields.

use super::samples::{RATE_RANGE_HZ, samples};
use crate::body::{Side, WalkerModel};
use crate::gait::Gait;
use crate::model_error::ModelError;
use crate::walking::{BEZIER_COEFFICIENTS, CYCLE, DomainKind, basis, phase_gradient};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Value of the field `format`.
const FORMAT: &str = "gaitwright controller";
/// Version of the layout.
const FORMAT_VERSION: u32 = 1;
/// Names of the angles of the walker, in the order of the phase gradient.
const ANGLES: [&str; 7] = ["torso", "hip_L", "knee_L", "ankle_L", "hip_R", "knee_R", "ankle_R"];

/// Description of each field; part of the file.
const FIELDS: [(&str, &str); 29] = [
    ("format", "type of this file"),
    ("format_version", "version of the layout"),
    ("fields", "descriptions of the fields"),
    (
        "signs",
        "forward lean, hip flexion, knee flexion and ankle dorsiflexion are positive; R is the prosthesis, L the intact leg",
    ),
    ("device", "name of the prosthesis"),
    (
        "certificate_passed",
        "whether the certificate of the gait passed; false means that at least one independent check exceeded its limit",
    ),
    ("stride_time_s", "time from right heel strike to the next, s"),
    ("stride_length_m", "distance between right heel strikes, m"),
    ("domains", "the eight domains of a stride (contact configurations), in order from right heel strike"),
    (
        "domains.name",
        "DS2 and DS3: double support; SS2 and SS1: single support on the flat foot and on the toe; R or L: the stance leg",
    ),
    ("domains.stance", "the stance leg; in double support, the leg that becomes the stance leg"),
    ("domains.duration_s", "planned duration, s"),
    ("domains.ends", "the event that ends the domain"),
    (
        "domains.phase_gradient_m_per_rad",
        "coefficients c of the linearised hip position over the stance toe, p = sum of c times angle, m/rad",
    ),
    (
        "domains.phase_start_m",
        "p at the start of the domain; the phase is s = (p - phase_start_m) / (phase_end_m - phase_start_m)",
    ),
    ("domains.phase_end_m", "p at the end of the domain"),
    ("domains.hip_velocity_m_s", "set point of the rate of p, m/s; null in underactuated domains, in which p is free"),
    ("domains.outputs", "joints that the controller drives along a curve y(s)"),
    ("domains.outputs.joint", "name of the joint; torso stands for the torso lean"),
    ("domains.outputs.bezier_rad", "coefficients a_0..a_5 of y(s) = sum of a_i C(5,i) s^i (1-s)^(5-i), rad"),
    ("trajectory", "set points of the prosthetic joints over one stride, for proportional-derivative tracking in time"),
    ("trajectory.rate_hz", "samples per second; the last sample is the end of the stride"),
    ("trajectory.time_s", "time of each sample from right heel strike, s"),
    ("trajectory.knee_rad", "knee angle, flexion positive, rad"),
    ("trajectory.ankle_rad", "ankle angle, dorsiflexion positive, rad"),
    ("trajectory.knee_rad_s", "knee velocity, rad/s; discontinuous at impacts"),
    ("trajectory.ankle_rad_s", "ankle velocity, rad/s; discontinuous at impacts"),
    ("trajectory.knee_torque_n_m", "feed-forward knee torque of the gait, flexion positive, N m"),
    ("trajectory.ankle_torque_n_m", "feed-forward ankle torque of the gait, dorsiflexion positive, N m"),
];

/// A controller file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerFile {
    /// `gaitwright controller`.
    pub format: String,
    /// Version of the layout.
    pub format_version: u32,
    /// Description of each field.
    pub fields: BTreeMap<String, String>,
    /// Name of the prosthesis.
    pub device: String,
    /// Whether the certificate of the gait passed. Absent in the file of a blinded walk, because it could identify the
    /// gait.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certificate_passed: Option<bool>,
    /// Stride time, s.
    pub stride_time_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
    /// The eight domains.
    pub domains: Vec<ControlledDomain>,
    /// Set points of the prosthetic joints over time.
    pub trajectory: Trajectory,
}

/// A domain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControlledDomain {
    /// Name: `DS2_R`, ...
    pub name: String,
    /// The stance leg.
    pub stance: Side,
    /// Planned duration, s.
    pub duration_s: f64,
    /// The event that ends the domain.
    pub ends: String,
    /// Derivative of the hip position with respect to each angle, m/rad.
    pub phase_gradient_m_per_rad: BTreeMap<String, f64>,
    /// Hip position at the start, m.
    pub phase_start_m: f64,
    /// Hip position at the end, m.
    pub phase_end_m: f64,
    /// Set point of the hip velocity, m/s; `None` in underactuated domains.
    pub hip_velocity_m_s: Option<f64>,
    /// The joints that the controller drives.
    pub outputs: Vec<Output>,
}

/// A driven joint and its curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Name: `hip_L`, ...
    pub joint: String,
    /// Bezier coefficients, rad.
    pub bezier_rad: [f64; BEZIER_COEFFICIENTS],
}

impl Output {
    /// The set point at a phase, rad.
    pub fn at(&self, s: f64) -> f64 {
        self.bezier_rad.iter().zip(basis(s)[0]).map(|(a, b)| a * b).sum()
    }
}

/// Set points of the prosthetic joints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trajectory {
    /// Sampling rate, Hz.
    pub rate_hz: f64,
    /// Times of the samples from right heel strike, s.
    pub time_s: Vec<f64>,
    /// Knee angle, flexion positive, rad.
    pub knee_rad: Vec<f64>,
    /// Ankle angle, dorsiflexion positive, rad.
    pub ankle_rad: Vec<f64>,
    /// Knee velocity, rad/s.
    pub knee_rad_s: Vec<f64>,
    /// Ankle velocity, rad/s.
    pub ankle_rad_s: Vec<f64>,
    /// Feed-forward knee torque, N m.
    pub knee_torque_n_m: Vec<f64>,
    /// Feed-forward ankle torque, N m.
    pub ankle_torque_n_m: Vec<f64>,
}

fn ends(kind: DomainKind) -> &'static str {
    match kind {
        DomainKind::Ds2 => "the stance toe lands",
        DomainKind::Ds3 => "the trailing toe is unloaded",
        DomainKind::Ss2 => "the stance heel is unloaded",
        DomainKind::Ss1 => "the swing heel lands",
    }
}

impl ControllerFile {
    /// The controller file of a gait, with set points at a sampling rate.
    ///
    /// # Errors
    /// [`ModelError`] if the gait is malformed or the rate is outside [`RATE_RANGE_HZ`].
    pub fn new(gait: &Gait, rate_hz: f64) -> Result<Self, ModelError> {
        let rows = samples(gait, rate_hz)?;
        let model = WalkerModel::new(&gait.subject, &gait.device)?;
        let domains = gait
            .domains
            .iter()
            .zip(CYCLE)
            .map(|(trajectory, domain)| ControlledDomain {
                name: trajectory.name.clone(),
                stance: domain.stance,
                duration_s: trajectory.duration_s,
                ends: ends(domain.kind).to_owned(),
                phase_gradient_m_per_rad: ANGLES
                    .iter()
                    .zip(phase_gradient(&model, domain.stance))
                    .map(|(name, value)| ((*name).to_owned(), value))
                    .collect(),
                phase_start_m: trajectory.phase_start_m,
                phase_end_m: trajectory.phase_end_m,
                hip_velocity_m_s: domain.hip_velocity_index().map(|i| gait.hip_velocity_m_s[i]),
                outputs: trajectory
                    .outputs
                    .iter()
                    .zip(&trajectory.bezier)
                    .map(|(&coordinate, row)| Output {
                        joint: ANGLES[coordinate - 2].to_owned(),
                        bezier_rad: std::array::from_fn(|i| row[i]),
                    })
                    .collect(),
            })
            .collect();
        // Prosthetic knee and ankle are the last two coordinates and the last two torques.
        let column = |value: &dyn Fn(&crate::gait::between_nodes::GaitInstant) -> f64| {
            rows.iter().map(|(_, i)| value(i)).collect()
        };
        let trajectory = Trajectory {
            rate_hz,
            time_s: rows.iter().map(|(time, _)| *time).collect(),
            knee_rad: column(&|i| i.q[7]),
            ankle_rad: column(&|i| i.q[8]),
            knee_rad_s: column(&|i| i.qd[7]),
            ankle_rad_s: column(&|i| i.qd[8]),
            knee_torque_n_m: column(&|i| i.u[4]),
            ankle_torque_n_m: column(&|i| i.u[5]),
        };
        Ok(Self {
            format: FORMAT.to_owned(),
            format_version: FORMAT_VERSION,
            fields: FIELDS.iter().map(|(name, words)| ((*name).to_owned(), (*words).to_owned())).collect(),
            device: gait.device.name.clone(),
            certificate_passed: None,
            stride_time_s: gait.domains.iter().map(|d| d.duration_s).sum(),
            stride_length_m: gait.stride_length_m,
            domains,
            trajectory,
        })
    }

    /// Parses and validates a controller file.
    ///
    /// # Errors
    /// [`ModelError`] with line and column, or with the reason.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        let malformed = |reason: String| ModelError::Malformed { what: "controller file".to_owned(), reason };
        let file: Self = serde_json::from_str(text).map_err(|e| malformed(e.to_string()))?;
        if file.format != FORMAT || file.format_version != FORMAT_VERSION {
            return Err(malformed(format!("format {:?} version {} is unknown", file.format, file.format_version)));
        }
        ModelError::check_range("trajectory.rate_hz", file.trajectory.rate_hz, RATE_RANGE_HZ.0, RATE_RANGE_HZ.1)?;
        if !file.domains.iter().map(|d| d.name.as_str()).eq(CYCLE.iter().map(|d| d.name())) {
            return Err(malformed("the file must have the eight domains of a stride in order".to_owned()));
        }
        let t = &file.trajectory;
        let columns =
            [&t.knee_rad, &t.ankle_rad, &t.knee_rad_s, &t.ankle_rad_s, &t.knee_torque_n_m, &t.ankle_torque_n_m];
        if columns.iter().any(|column| column.len() != t.time_s.len()) {
            return Err(malformed("all columns of the trajectory must have the same length".to_owned()));
        }
        Ok(file)
    }
}
