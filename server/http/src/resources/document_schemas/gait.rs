//! Gaits.

#![allow(dead_code)] // Schemas are never constructed.

use super::settings::DeviceDefinition;
use gaitwright_service::studies::study_plan_schemas::{BoundsSchema, GaitSettingsSchema};
use serde::Serialize;
use utoipa::ToSchema;

/// A gait: eight domains over one stride from right heel strike. R is the prosthesis, L the intact leg.
#[derive(Debug, ToSchema)]
pub(crate) struct GaitDocument {
    /// Version of this layout.
    format_version: u32,
    /// The subject.
    subject: WalkerSubject,
    /// The device.
    device: DeviceDefinition,
    /// Whether the gait has muscles.
    muscles: bool,
    /// The values of the bounds that can be tuned.
    bounds: BoundsSchema,
    /// The other settings of the gait problem.
    settings: GaitSettingsSchema,
    /// Mean walking speed, m/s.
    speed_m_s: f64,
    /// Stride length, m.
    stride_length_m: f64,
    /// Length of the step that ends with left heel strike, m.
    right_step_length_m: f64,
    /// Stride time, s.
    stride_time_s: f64,
    /// Set points of the hip velocity, m/s: one for each sequence of domains without impact, DS2_R; DS3_R and SS2_R;
    /// DS2_L; DS3_L and SS2_L.
    #[schema(min_items = 4, max_items = 4)]
    hip_velocity_m_s: Vec<f64>,
    /// The domains in the order DS2_R, DS3_R, SS2_R, SS1_R, DS2_L, DS3_L, SS2_L, SS1_L.
    #[schema(min_items = 8, max_items = 8)]
    domains: Vec<DomainTrajectory>,
}

/// Height and mass of the person who walks.
#[derive(Debug, ToSchema)]
pub(crate) struct WalkerSubject {
    /// Body height, m.
    height_m: f64,
    /// Body mass, kg.
    body_mass_kg: f64,
}

/// The trajectory in one domain, at equidistant nodes. Lists *at each node* have one row for each entry of `time_s`.
#[derive(Debug, ToSchema)]
struct DomainTrajectory {
    /// Name: DS2 and DS3 for double support, SS2 and SS1 for single support on the flat foot and on the toe, with _R or
    /// _L for the stance leg.
    name: String,
    /// Duration, s.
    duration_s: f64,
    /// Time of each node from the start of the stride, s.
    time_s: Vec<f64>,
    /// Coordinates at each node: 9 numbers, the hip position forwards and upwards (m), then torso, hip_L, knee_L, ankle_L,
    /// hip_R, knee_R and ankle_R (rad).
    q: Vec<Vec<f64>>,
    /// Velocities at each node, in the order of `q`, m/s and rad/s.
    qd: Vec<Vec<f64>>,
    /// Accelerations at each node, in the order of `q`, m/s² and rad/s².
    qdd: Vec<Vec<f64>>,
    /// Joint torques at each node: 6 numbers, hip_L, knee_L, ankle_L, hip_R, knee_R and ankle_R, N m.
    u: Vec<Vec<f64>>,
    /// Names of the components of the ground reaction forces.
    contact_rows: Vec<ContactRowName>,
    /// Ground reaction forces at each node, in the order of `contact_rows`, N.
    contact_forces: Vec<Vec<f64>>,
    /// States of the muscles. Null without muscles.
    muscles: Option<MuscleTrajectory>,
    /// Coordinates that the virtual constraints drive, as indices into a row of `q`, counted from 0.
    #[schema(value_type = Vec<u32>)]
    outputs: Vec<usize>,
    /// For each output, the 6 Bezier coefficients of its curve over the phase, rad.
    bezier: Vec<Vec<f64>>,
    /// Hip position at the start of the domain, where the phase is 0, m.
    phase_start_m: f64,
    /// Hip position at the end of the domain, where the phase is 1, m.
    phase_end_m: f64,
    /// Impulse of the impact at the start of the domain, in the order of `contact_rows`, N s. Null without an impact.
    impulse: Option<Vec<f64>>,
}

/// A component of the ground reaction force on one contact point.
#[derive(Debug, ToSchema)]
struct ContactRowName {
    /// Point of the foot.
    point: ContactPoint,
    /// Leg: `left` (intact) or `right` (prosthesis).
    side: Leg,
    /// Direction: `x` forwards, `z` upwards.
    axis: ForceAxis,
}

/// A contact point of the foot.
#[derive(Debug, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
enum ContactPoint {
    Heel,
    Toe,
}

/// A leg: `left` (intact) or `right` (prosthesis).
#[derive(Debug, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum Leg {
    Left,
    Right,
}

/// The direction of a force: `x` forwards, `z` upwards.
#[derive(Debug, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
enum ForceAxis {
    X,
    Z,
}

/// States of the ten muscle-tendon units at each node. A row has 10 numbers, for HAM_L, GLU_L, HFL_L, GAS_L, VAS_L, SOL_L,
/// TA_L, HAM_R, GLU_R and HFL_R.
#[derive(Debug, ToSchema)]
struct MuscleTrajectory {
    /// Fibre lengths, in optimal fibre lengths.
    fibre_length: Vec<Vec<f64>>,
    /// Fibre velocities, in optimal fibre lengths per second; negative in shortening.
    fibre_velocity: Vec<Vec<f64>>,
    /// Activations, 0 to 1.
    activation: Vec<Vec<f64>>,
}
