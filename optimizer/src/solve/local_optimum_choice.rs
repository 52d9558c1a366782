//! Which of several local optima is the outcome of a solve, as an option.

use crate::model_error::ModelError;
use serde::{Deserialize, Serialize};

/// The choice among several converged gaits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum LocalOptimumChoice {
    /// The gait with the lowest objective.
    #[default]
    LowestObjective,
    /// The gait with the lowest Gait RMSE among those with an objective near the lowest.
    NearestToReference {
        /// Largest excess over the lowest objective, per cent.
        within_percent: f64,
    },
}

impl LocalOptimumChoice {
    /// Checks the percentage.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        match self {
            Self::LowestObjective => Ok(()),
            Self::NearestToReference { within_percent } => {
                ModelError::check_range("local_optimum_choice.within_percent", *within_percent, 0.0, 100.0).map(|_| ())
            }
        }
    }
}
