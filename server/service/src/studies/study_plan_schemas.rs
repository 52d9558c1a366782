//! Schemas of the parts of a study plan that commands receive and REST serves as other crates read and write them.

use gaitwright_store::studies::SimulatedWalksEffect;
use serde_json::Value;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// Settings of the gait problem.
#[derive(Debug, ToSchema)]
#[schema(as = GaitSettings)]
pub struct GaitSettingsSchema(pub BTreeMap<String, Value>);

/// Options of the solver: limits, tolerance, initial guesses and retries.
#[derive(Debug, ToSchema)]
#[schema(as = SolveOptions)]
pub struct SolveOptionsSchema(pub BTreeMap<String, Value>);

/// Settings of the learner.
#[derive(Debug, ToSchema)]
#[schema(as = LearnerSettings)]
pub struct LearnerSettingsSchema(pub BTreeMap<String, Value>);

/// Values of the bounds that can be tuned.
#[derive(Debug, ToSchema)]
#[schema(as = Bounds)]
pub struct BoundsSchema(pub BTreeMap<String, Value>);

/// A grid of actions.
#[derive(Debug, ToSchema)]
#[schema(as = SearchSpace)]
pub struct SearchSpaceSchema {
    /// One dimension for each tuned bound.
    pub dimensions: Vec<DimensionSchema>,
}

/// One tuned bound of a search space.
#[derive(Debug, ToSchema)]
#[schema(as = Dimension)]
pub struct DimensionSchema {
    /// Name of the bound.
    pub name: String,
    /// Values of the bound, in its unit, ascending.
    pub values: Vec<f64>,
    /// How far apart two values can be, in the unit of the bound, while their gaits are still expected to have similar
    /// utility.
    pub lengthscale: f64,
}

/// Simulated walks with the gaits of a study. Their seed is that of the study, so that all gaits meet the same
/// disturbances.
#[derive(Debug, ToSchema)]
#[schema(as = SimulatedWalks)]
pub struct SimulatedWalksSchema {
    /// Effect of the simulated walks on the study.
    #[schema(required = false, default = "none")]
    pub effect: SimulatedWalksEffect,
    /// Number of simulated walks on each of the three kinds of ground, 1 to 1000.
    #[schema(required = false, default = 50, minimum = 1, maximum = 1000)]
    pub number: u32,
    /// `tie_break`: difference in Gait RMSE, rad, below which two gaits are compared by their mean strides. 0 to 10.
    #[schema(required = false, default = 0.05, minimum = 0, maximum = 10)]
    pub gait_rmse_tolerance_rad: f64,
    /// `label`: minimum mean strides of an executable gait. A complete simulated walk has 20 strides. 0 to 20.
    #[schema(required = false, default = 3.0, minimum = 0, maximum = 20)]
    pub least_mean_strides: f64,
}
