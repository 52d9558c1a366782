//! Problem files: everything that a solve depends on.

#![allow(dead_code)] // Schemas are never constructed.

use super::gait::WalkerSubject;
use super::reference_gait::ReferenceGaitDocument;
use super::settings::DeviceDefinition;
use gaitwright_service::studies::study_plan_schemas::{BoundsSchema, GaitSettingsSchema, SolveOptionsSchema};
use serde::Serialize;
use utoipa::ToSchema;

/// Input for `gaitwright solve --problem`: the gait problem, options and warm start.
#[derive(Debug, ToSchema)]
pub(crate) struct SolveProblem {
    /// The gait problem.
    problem: GaitProblem,
    /// Options of the solver.
    options: SolveOptionsSchema,
    /// The warm start. Null for a cold start.
    warm_start: Option<WarmStart>,
}

/// The definition of a gait problem.
#[derive(Debug, ToSchema)]
struct GaitProblem {
    /// The subject.
    subject: WalkerSubject,
    /// The device.
    device: DeviceDefinition,
    /// The values of the bounds that can be tuned.
    bounds: BoundsSchema,
    /// Whether the problem has muscles.
    muscles: bool,
    /// The other settings of the problem.
    settings: GaitSettingsSchema,
    /// The reference gait, for Gait RMSE and for initial guesses.
    reference: ReferenceGaitDocument,
}

/// The solution of an earlier solve, from which a solve begins.
#[derive(Debug, ToSchema)]
struct WarmStart {
    /// Whether the earlier solve had muscles.
    muscles: bool,
    /// Mesh of the earlier solve.
    mesh: MeshIntervals,
    /// Scaled variables and multipliers.
    point: PrimalDualPoint,
    /// Margins by which bounds are tightened, because an earlier gait violated them between nodes. Absent if there are none.
    #[schema(required = false)]
    margins: TightenedBounds,
}

/// Number of mesh intervals of each kind of domain.
#[derive(Debug, ToSchema)]
struct MeshIntervals {
    /// Intervals of DS2.
    ds2: u32,
    /// Intervals of DS3.
    ds3: u32,
    /// Intervals of SS2.
    ss2: u32,
    /// Intervals of SS1.
    ss1: u32,
}

/// A primal-dual point of the nonlinear program with n variables and m rows, scaled.
#[derive(Debug, ToSchema)]
struct PrimalDualPoint {
    /// n variables.
    x: Vec<f64>,
    /// m multipliers of the rows.
    row_multipliers: Vec<f64>,
    /// n multipliers of the lower bounds of variables.
    lower_multipliers: Vec<f64>,
    /// n multipliers of the upper bounds of variables.
    upper_multipliers: Vec<f64>,
    /// m slacks of the rows. If empty, the values of the rows are used.
    slacks: Vec<f64>,
    /// m multipliers of the lower bounds of slacks. If empty, they are derived from the multipliers of the rows.
    slack_lower_multipliers: Vec<f64>,
    /// m multipliers of the upper bounds of slacks. If empty, they are derived from the multipliers of the rows.
    slack_upper_multipliers: Vec<f64>,
}

/// Margins of tightened bounds, scaled.
#[derive(Debug, ToSchema)]
struct TightenedBounds {
    /// For each tightened variable a list of its number, from 0, and a list of two margins, of its lower and of its upper
    /// bound.
    #[schema(value_type = Vec<Vec<MarginEntry>>)]
    variables: Vec<(usize, [f64; 2])>,
    /// For each tightened row a list of its number, from 0, and the margin of its lower bound.
    #[schema(value_type = Vec<Vec<f64>>)]
    rows: Vec<(usize, f64)>,
}

/// The number of a variable, or the margins of its lower and of its upper bound.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
enum MarginEntry {
    Variable(u32),
    Margins(Vec<f64>),
}
