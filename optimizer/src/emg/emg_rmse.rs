//! EMG RMSE: the distance of the muscle activity of a gait from normal walking.

use super::cycle_activity::CycleActivity;
use crate::model_error::ModelError;
use serde::{Deserialize, Serialize};

/// EMG RMSE of a gait and its parts, relative to the peaks of normal walking.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EmgRmse {
    /// Sum of the parts.
    pub total: f64,
    /// RMS difference of each channel, in the order of normal walking.
    pub parts: Vec<f64>,
    /// Warnings about doubtful channels.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

/// Ratio of peaks above which a channel is doubtful.
const MAX_PEAK_RATIO: f64 = 10.0;

/// The warning for a channel that is implausibly more active than in normal walking.
fn doubt(activity: &CycleActivity, normal: &CycleActivity) -> Option<String> {
    let times = activity.peak() / normal.peak();
    (times > MAX_PEAK_RATIO).then(|| {
        let name = &activity.channel;
        format!("the peak of {name} is {times:.1} times that of the walk without the device; check that both recordings have the same unit")
    })
}

/// EMG RMSE of a gait against normal walking: `sum_i sqrt(mean((s_i - n_i)^2))` over the channels of normal walking.
/// The paper omits the square inside the mean, without which the mean could be negative.
///
/// # Errors
/// [`ModelError::Unknown`] for a channel that is missing in the gait.
pub fn emg_rmse(gait: &[CycleActivity], normal_walking: &[CycleActivity]) -> Result<EmgRmse, ModelError> {
    let (mut parts, mut warnings) = (Vec::new(), Vec::new());
    for normal in normal_walking {
        let activity = normal.same_channel(gait)?;
        let squares: f64 = activity.mean.iter().zip(&normal.mean).map(|(a, n)| (a - n).powi(2)).sum();
        parts.push((squares / normal.mean.len() as f64).sqrt());
        warnings.extend(doubt(activity, normal));
    }
    Ok(EmgRmse { total: parts.iter().sum(), parts, warnings })
}
