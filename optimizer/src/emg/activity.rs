//! Muscle activity of a gait in shares of normal walking: curves, averages, distance.

use super::{CycleActivity, EmgRmse, emg_rmse};
use crate::subject::ModelError;
use serde::{Deserialize, Serialize};

/// Muscle activity over the gait cycle, in shares of the peaks of normal walking.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Activity {
    /// Each channel of normal walking, in its order.
    pub channels: Vec<CycleActivity>,
    /// Mean over the cycle of each channel.
    pub averages: Vec<f64>,
    /// Distance from normal walking; none for normal walking itself.
    pub emg_rmse: Option<EmgRmse>,
}

impl Activity {
    /// Of normal walking, whose peaks are 1.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] for a channel without activity.
    pub fn of_normal_walking(normal: &[CycleActivity]) -> Result<Self, ModelError> {
        Ok(Self::new(normalised(normal, normal)?, None))
    }

    /// Of another gait.
    ///
    /// # Errors
    /// [`ModelError::Unknown`] for a channel that the gait lacks, [`ModelError::Malformed`] for one without activity in
    /// normal walking.
    pub fn of_gait(gait: &[CycleActivity], normal: &[CycleActivity]) -> Result<Self, ModelError> {
        let channels = normalised(gait, normal)?;
        let distance = emg_rmse(&channels, &normalised(normal, normal)?)?;
        Ok(Self::new(channels, Some(distance)))
    }

    fn new(channels: Vec<CycleActivity>, emg_rmse: Option<EmgRmse>) -> Self {
        Self { averages: channels.iter().map(CycleActivity::average).collect(), channels, emg_rmse }
    }
}

/// The channels of normal walking, in its order, in shares of its peaks.
fn normalised(gait: &[CycleActivity], normal: &[CycleActivity]) -> Result<Vec<CycleActivity>, ModelError> {
    normal.iter().map(|normal| normal.same_channel(gait)?.normalised_by(normal)).collect()
}
