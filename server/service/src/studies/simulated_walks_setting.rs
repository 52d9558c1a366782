//! The setting of simulated walks as clients write and read it.

use gaitwright_store::studies::{SimulatedWalks, SimulatedWalksEffect};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Simulated walks with the gaits of a study. Their seed is that of the study, so that all gaits meet the same
/// disturbances.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SimulatedWalksSetting {
    /// Effect of the simulated walks on the study.
    #[schema(required = false, default = "none")]
    pub effect: SimulatedWalksEffect,
    /// Number of simulated walks on each of the three kinds of ground, 1 to 1000.
    #[schema(required = false, default = 50, minimum = 1, maximum = 1000)]
    pub number_of_simulated_walks: u32,
    /// `tie_break`: difference in Gait RMSE, rad, below which two gaits are compared by their mean strides. 0 to 10.
    #[schema(required = false, default = 0.05, minimum = 0, maximum = 10)]
    pub gait_rmse_tolerance_rad: f64,
    /// `label`: minimum mean strides of an executable gait. A complete simulated walk has 20 strides. 0 to 20.
    #[schema(required = false, default = 3.0, minimum = 0, maximum = 20)]
    pub least_mean_strides: f64,
}

impl Default for SimulatedWalksSetting {
    fn default() -> Self {
        SimulatedWalks::default().into()
    }
}

impl From<SimulatedWalks> for SimulatedWalksSetting {
    fn from(stored: SimulatedWalks) -> Self {
        let SimulatedWalks { effect, number_of_simulated_walks, gait_rmse_tolerance_rad, least_mean_strides } = stored;
        Self { effect, number_of_simulated_walks, gait_rmse_tolerance_rad, least_mean_strides }
    }
}

impl From<SimulatedWalksSetting> for SimulatedWalks {
    fn from(setting: SimulatedWalksSetting) -> Self {
        let SimulatedWalksSetting { effect, number_of_simulated_walks, gait_rmse_tolerance_rad, least_mean_strides } =
            setting;
        Self { effect, number_of_simulated_walks, gait_rmse_tolerance_rad, least_mean_strides }
    }
}
