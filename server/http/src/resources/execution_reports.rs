//! Execution reports of gaits.

use gait_optimizer::execution;
use serde::Serialize;
use utoipa::ToSchema;

/// Simulated walks with a gait, by a model other than the optimiser's.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ExecutionReport {
    /// Version of this layout and of the simulation.
    format_version: u32,
    /// SHA-256 of the gait as compact JSON, as in its certificate.
    gait_sha256: String,
    /// Seed of the disturbances.
    seed: u64,
    /// Strides of a complete simulated walk.
    strides: u32,
    /// Range from which the body masses of disturbed simulated walks are drawn, kg: ±5 %, limited to the range of the model.
    #[schema(value_type = Vec<f64>, min_items = 2, max_items = 2)]
    body_mass_kg: [f64; 2],
    /// Completed strides without any disturbance.
    undisturbed_strides: u32,
    /// Randomly disturbed simulated walks, for each kind of ground.
    grounds: Vec<SimulatedWalksOnGround>,
    /// Undisturbed simulated walks on level ground, ordered from hard ground to soft ground. In all others the ground yields
    /// 0.01 m under body weight.
    strides_by_yield: Vec<StridesOnYield>,
    /// Largest pushes survived. Null if the walker does not complete the undisturbed walk.
    pushes: Option<SurvivedPushes>,
}

impl From<execution::ExecutionReport> for ExecutionReport {
    fn from(report: execution::ExecutionReport) -> Self {
        let execution::ExecutionReport {
            format_version,
            gait_sha256,
            seed,
            strides,
            body_mass_kg,
            undisturbed_strides,
            grounds,
            strides_by_yield,
            pushes,
        } = report;
        Self {
            format_version,
            gait_sha256,
            seed,
            strides,
            body_mass_kg,
            undisturbed_strides,
            grounds: grounds.into_iter().map(Into::into).collect(),
            strides_by_yield: strides_by_yield.into_iter().map(Into::into).collect(),
            pushes: pushes.map(Into::into),
        }
    }
}

/// Simulated walks on one kind of ground.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct SimulatedWalksOnGround {
    /// Largest height of bumps and depth of dips in the ground, m.
    ground_height_m: f64,
    /// Number of simulated walks.
    number_of_simulated_walks: u32,
    /// Simulated walks that completed all strides.
    completed: u32,
    /// Simulated walks that ended with a fall.
    fell: u32,
    /// Simulated walks that ended with a halt: the walker took no further step.
    halted: u32,
    /// Share of completed simulated walks.
    completed_share: f64,
    /// 95 % confidence interval of this share (Wilson).
    #[schema(value_type = Vec<f64>, min_items = 2, max_items = 2)]
    completed_share_interval: [f64; 2],
    /// Mean number of completed strides.
    mean_strides: f64,
    /// Share of the time in which the controller demanded more than the largest torque of the prosthetic knee.
    knee_saturated_share: f64,
    /// Share of the time in which the controller demanded more than the largest torque of the prosthetic ankle.
    ankle_saturated_share: f64,
    /// Share of the time in which the controller demanded a faster change of the knee torque than the actuator can
    /// produce.
    knee_rate_limited_share: f64,
    /// Share of the time in which the controller demanded a faster change of the ankle torque than the actuator can
    /// produce.
    ankle_rate_limited_share: f64,
}

impl From<execution::SimulatedWalksOnGround> for SimulatedWalksOnGround {
    fn from(ground: execution::SimulatedWalksOnGround) -> Self {
        let execution::SimulatedWalksOnGround {
            ground_height_m,
            number_of_simulated_walks,
            completed,
            fell,
            halted,
            completed_share,
            completed_share_interval,
            mean_strides,
            knee_saturated_share,
            ankle_saturated_share,
            knee_rate_limited_share,
            ankle_rate_limited_share,
        } = ground;
        Self {
            ground_height_m,
            number_of_simulated_walks,
            completed,
            fell,
            halted,
            completed_share,
            completed_share_interval,
            mean_strides,
            knee_saturated_share,
            ankle_saturated_share,
            knee_rate_limited_share,
            ankle_rate_limited_share,
        }
    }
}

/// Undisturbed simulated walk on ground of a given stiffness.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct StridesOnYield {
    /// How far the ground yields under body weight, m.
    yield_m: f64,
    /// Completed strides.
    strides: u32,
}

impl From<execution::StridesOnYield> for StridesOnYield {
    fn from(walk: execution::StridesOnYield) -> Self {
        let execution::StridesOnYield { yield_m, strides } = walk;
        Self { yield_m, strides }
    }
}

/// Largest pushes in a fixed, increasing series that the walker survives without other disturbances.
#[derive(Debug, Serialize, ToSchema)]
#[allow(clippy::struct_field_names)] // their unit
pub(crate) struct SurvivedPushes {
    /// Forwards, N s; 0 if it survives none.
    forwards_n_s: f64,
    /// Backwards, N s; 0 if it survives none.
    backwards_n_s: f64,
    /// Largest push of the series, N s.
    largest_tried_n_s: f64,
}

impl From<execution::SurvivedPushes> for SurvivedPushes {
    fn from(pushes: execution::SurvivedPushes) -> Self {
        let execution::SurvivedPushes { forwards_n_s, backwards_n_s, largest_tried_n_s } = pushes;
        Self { forwards_n_s, backwards_n_s, largest_tried_n_s }
    }
}
