//! OpenAPI schemas of the parts of a study plan whose types belong to other crates.

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
