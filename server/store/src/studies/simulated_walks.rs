//! Effect of simulated walks in a study.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Effect of simulated walks with each gait on a study: `none`, the service simulates none by itself; `report`, each gait
/// gets an execution report; `tie_break`, the report also decides between two gaits with nearly the same Gait RMSE;
/// `label`, a gait with too few mean strides gets the label `not_executable`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SimulatedWalksEffect {
    /// The service simulates no walks by itself.
    #[default]
    None,
    /// Each gait gets an execution report; trials are not affected.
    Report,
    /// The report also decides between two gaits with nearly the same Gait RMSE.
    TieBreak,
    /// A gait with too few mean strides gets the label *not executable*.
    Label,
}

impl SimulatedWalksEffect {
    /// Every effect.
    pub const ALL: [Self; 4] = [Self::None, Self::Report, Self::TieBreak, Self::Label];

    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Report => "report",
            Self::TieBreak => "tie_break",
            Self::Label => "label",
        }
    }

    /// Whether the result of a trial depends on the simulated walks, so that it waits for them.
    pub fn is_part_of_result(self) -> bool {
        matches!(self, Self::TieBreak | Self::Label)
    }
}

/// Simulated walks with the gaits of a study. Their seed is that of the study, so that all gaits meet the same
/// disturbances.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SimulatedWalks {
    /// Effect of the simulated walks on the study.
    pub effect: SimulatedWalksEffect,
    /// Number of simulated walks on each of the three kinds of ground, 1 to 1000.
    pub number_of_simulated_walks: u32,
    /// `tie_break`: difference in Gait RMSE, rad, below which two gaits are compared by their mean strides. 0 to 10.
    pub gait_rmse_tolerance_rad: f64,
    /// `label`: minimum mean strides of an executable gait. A complete simulated walk has 20 strides. 0 to 20.
    pub least_mean_strides: f64,
}

impl Default for SimulatedWalks {
    fn default() -> Self {
        Self {
            effect: SimulatedWalksEffect::None,
            number_of_simulated_walks: 50,
            gait_rmse_tolerance_rad: 0.05,
            least_mean_strides: 3.0,
        }
    }
}
