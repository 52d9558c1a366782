//! Flags of `tune` for simulated walks with each gait.

use super::flag_choices::{SIMULATED_WALKS, one_of};
use super::flag_numbers::{number, whole};
use clap::Args;
use gaitwright_service::studies::execution::MAX_SIMULATED_WALKS;
use gaitwright_service::studies::simulated_walks_setting::SimulatedWalksSetting;
use gaitwright_store::studies::SimulatedWalksEffect;

fn simulated_walks(text: &str) -> Result<u32, String> {
    whole(text, 1, MAX_SIMULATED_WALKS)
}

#[derive(Debug, Clone, Args)]
pub(super) struct SimulatedWalksFlags {
    /// Effect of simulated walks with each gait on the study (default: none).
    #[arg(long, value_name = "EFFECT", value_parser = one_of::<SimulatedWalksEffect>(SIMULATED_WALKS))]
    simulated_walks_effect: Option<SimulatedWalksEffect>,
    /// Number of simulated walks with each gait on each of the three kinds of ground (default: 50).
    #[arg(long, value_name = "NUMBER", value_parser = simulated_walks, allow_negative_numbers = true, requires = "simulated_walks_effect")]
    simulated_walks: Option<u32>,
    /// For `tie_break`: difference in Gait RMSE, rad, below which two gaits are compared by their mean strides
    /// (default: 0.05).
    #[arg(long, value_name = "RAD", value_parser = number, allow_negative_numbers = true, requires = "simulated_walks_effect")]
    gait_rmse_tolerance: Option<f64>,
    /// For `label`: minimum mean strides of an executable gait (default: 3).
    #[arg(long, value_name = "STRIDES", value_parser = number, allow_negative_numbers = true, requires = "simulated_walks_effect")]
    least_mean_strides: Option<f64>,
}

impl SimulatedWalksFlags {
    /// The setting of the study.
    pub(super) fn setting(&self) -> SimulatedWalksSetting {
        let default = SimulatedWalksSetting::default();
        SimulatedWalksSetting {
            effect: self.simulated_walks_effect.unwrap_or(default.effect),
            number_of_simulated_walks: self.simulated_walks.unwrap_or(default.number_of_simulated_walks),
            gait_rmse_tolerance_rad: self.gait_rmse_tolerance.unwrap_or(default.gait_rmse_tolerance_rad),
            least_mean_strides: self.least_mean_strides.unwrap_or(default.least_mean_strides),
        }
    }
}
