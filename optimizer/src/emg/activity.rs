//! Muscle activity of a gait relative to normal walking: curves, averages and EMG RMSE.

use super::{CycleActivity, EmgRmse, emg_rmse};
use crate::model_error::ModelError;
use serde::{Deserialize, Serialize};

/// Muscle activity over the gait cycle, relative to the peaks of normal walking.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Activity {
    /// The channels, in the order of normal walking.
    pub channels: Vec<CycleActivity>,
    /// Mean over the cycle of each channel.
    pub averages: Vec<f64>,
    /// Distance from normal walking; `None` for normal walking itself.
    pub emg_rmse: Option<EmgRmse>,
}

impl Activity {
    /// Activity of normal walking; its peaks are 1.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] for a channel without activity.
    pub fn of_normal_walking(normal: &[CycleActivity]) -> Result<Self, ModelError> {
        Ok(Self::new(normalised(normal, normal)?, None))
    }

    /// Activity of another gait.
    ///
    /// # Errors
    /// [`ModelError::Unknown`] for a channel that is missing in the gait, [`ModelError::Malformed`] for one without
    /// activity in normal walking.
    pub fn of_gait(gait: &[CycleActivity], normal: &[CycleActivity]) -> Result<Self, ModelError> {
        let channels = normalised(gait, normal)?;
        let distance = emg_rmse(&channels, &normalised(normal, normal)?)?;
        Ok(Self::new(channels, Some(distance)))
    }

    fn new(channels: Vec<CycleActivity>, emg_rmse: Option<EmgRmse>) -> Self {
        Self { averages: channels.iter().map(CycleActivity::average).collect(), channels, emg_rmse }
    }
}

/// Normalises the channels by the peaks of normal walking, in the order of normal walking.
fn normalised(gait: &[CycleActivity], normal: &[CycleActivity]) -> Result<Vec<CycleActivity>, ModelError> {
    normal.iter().map(|normal| normal.same_channel(gait)?.normalised_by(normal)).collect()
}
