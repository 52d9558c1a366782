//! Controller files.

#![allow(dead_code)] // Schemas are never constructed.

use super::gait::Leg;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// The file that the controller of a device reads. Forward lean, hip flexion, knee flexion and ankle dorsiflexion are
/// positive. R is the prosthesis, L the intact leg.
#[derive(Debug, ToSchema)]
pub(crate) struct ControllerFile {
    /// `gaitwright controller`.
    format: String,
    /// Version of the layout.
    format_version: u32,
    /// Description of each field, by its name.
    fields: BTreeMap<String, String>,
    /// Name of the device.
    device: String,
    /// Whether the certificate of the gait passed. Absent in the file of a blinded walk, because it could identify the gait.
    #[schema(required = false)]
    certificate_passed: bool,
    /// Time from one right heel strike to the next, s.
    stride_time_s: f64,
    /// Distance between right heel strikes, m.
    stride_length_m: f64,
    /// The domains of a stride, in order from right heel strike.
    #[schema(min_items = 8, max_items = 8)]
    domains: Vec<ControlledDomain>,
    /// Set points of the prosthetic joints over one stride, for tracking in time.
    trajectory: SetPoints,
}

/// A domain, as a controller tracks it.
#[derive(Debug, ToSchema)]
struct ControlledDomain {
    /// Name: DS2 and DS3 for double support, SS2 and SS1 for single support on the flat foot and on the toe, with _R or
    /// _L for the stance leg.
    name: String,
    /// The stance leg; in double support, the leg that becomes the stance leg.
    stance: Leg,
    /// Planned duration, s.
    duration_s: f64,
    /// The event that ends the domain.
    ends: String,
    /// Derivative of the hip position over the stance toe with respect to each angle, by the name of the angle: torso,
    /// hip_L, knee_L, ankle_L, hip_R, knee_R and ankle_R, m/rad.
    phase_gradient_m_per_rad: BTreeMap<String, f64>,
    /// Hip position at the start, where the phase is 0, m.
    phase_start_m: f64,
    /// Hip position at the end, where the phase is 1, m.
    phase_end_m: f64,
    /// Set point of the hip velocity, m/s. Null in underactuated domains, in which it is free.
    hip_velocity_m_s: Option<f64>,
    /// The joints that the controller drives.
    outputs: Vec<ControllerOutput>,
}

/// A driven joint and its curve over the phase.
#[derive(Debug, ToSchema)]
struct ControllerOutput {
    /// Name of the joint, such as `hip_L`; `torso` is the torso lean.
    joint: String,
    /// Bezier coefficients of the curve, of degree 5, rad.
    #[schema(min_items = 6, max_items = 6)]
    bezier_rad: Vec<f64>,
}

/// Set points of the prosthetic joints. All lists have one entry for each sample.
#[derive(Debug, ToSchema)]
struct SetPoints {
    /// Sampling rate, Hz.
    rate_hz: f64,
    /// Time of each sample from right heel strike, s. The last sample is the end of the stride.
    time_s: Vec<f64>,
    /// Knee angles, flexion positive, rad.
    knee_rad: Vec<f64>,
    /// Ankle angles, dorsiflexion positive, rad.
    ankle_rad: Vec<f64>,
    /// Knee velocities, rad/s; discontinuous at impacts.
    knee_rad_s: Vec<f64>,
    /// Ankle velocities, rad/s; discontinuous at impacts.
    ankle_rad_s: Vec<f64>,
    /// Feed-forward knee torques, flexion positive, N m.
    knee_torque_n_m: Vec<f64>,
    /// Feed-forward ankle torques, dorsiflexion positive, N m.
    ankle_torque_n_m: Vec<f64>,
}
