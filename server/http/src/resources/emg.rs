//! Processed EMG of lab sessions.

use super::document_schemas;
use gait_optimizer::emg::{self, EmgSettings};
use gaitwright_service::studies::lab;
use gaitwright_store::MeasurementFileId;
use serde::Serialize;
use utoipa::ToSchema;

/// The heel strike at which the cycle of a channel begins: `right_heel_strike`; `left_heel_strike`, as recorded; or
/// `assumed_left_heel_strike`, half a stride after the right one.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) enum CycleStart {
    #[serde(rename = "right_heel_strike")]
    Right,
    #[serde(rename = "left_heel_strike")]
    Left,
    #[serde(rename = "assumed_left_heel_strike")]
    AssumedLeft,
}

impl From<emg::CycleStart> for CycleStart {
    fn from(start: emg::CycleStart) -> Self {
        match start {
            emg::CycleStart::RightHeelStrike => Self::Right,
            emg::CycleStart::LeftHeelStrike => Self::Left,
            emg::CycleStart::AssumedLeftHeelStrike => Self::AssumedLeft,
        }
    }
}

/// Activity of a channel at 0, 1, ..., 100 % of the gait cycle, mean over strides.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct CycleActivity {
    /// Name of the channel.
    channel: String,
    /// Mean over strides, relative to the peak of walk 1.
    mean: Vec<f64>,
    /// Standard deviation over strides, relative to the peak of walk 1; zero for one stride.
    standard_deviation: Vec<f64>,
    /// Number of strides.
    #[schema(value_type = u64)]
    strides: usize,
    /// Heel strike at which the cycle begins: that of the leg of the channel. Results stored without this value begin at
    /// right heel strike.
    begins_at: CycleStart,
}

impl From<emg::CycleActivity> for CycleActivity {
    fn from(activity: emg::CycleActivity) -> Self {
        let emg::CycleActivity { channel, mean, standard_deviation, strides, begins_at } = activity;
        Self { channel, mean, standard_deviation, strides, begins_at: begins_at.into() }
    }
}

/// EMG RMSE of a walk, in total and for each channel, relative to the peak of the walk without the device.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct EmgRmse {
    /// Sum of the parts.
    total: f64,
    /// RMS difference of each channel, in the order of the channels of the walk without the device.
    parts: Vec<f64>,
    /// Reasons to doubt the comparison. Absent if there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(value_type = Vec<String>, required = false)]
    warnings: Vec<String>,
}

impl From<emg::EmgRmse> for EmgRmse {
    fn from(rmse: emg::EmgRmse) -> Self {
        let emg::EmgRmse { total, parts, warnings } = rmse;
        Self { total, parts, warnings }
    }
}

/// The activation of the muscle of a channel over the gait cycle.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ModelActivity {
    /// Name of the channel.
    channel: String,
    /// Name of the muscle.
    muscle: String,
    /// Activation at 0, 1, ..., 100 % of the cycle, 0 to 1.
    activation: Vec<f64>,
    /// RMS difference between activation and measured activity.
    rms_difference: f64,
    /// Correlation between activation and measured activity over the cycle; null if one of them is constant.
    correlation: Option<f64>,
}

impl From<emg::ModelActivity> for ModelActivity {
    fn from(activity: emg::ModelActivity) -> Self {
        let emg::ModelActivity { channel, muscle, activation, rms_difference, correlation } = activity;
        Self { channel, muscle, activation, rms_difference, correlation }
    }
}

/// Muscle activity of a walk over the gait cycle.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct WalkActivity {
    /// Number of the walk, 1 to 3.
    walk: u8,
    /// Measurement file that it was computed from.
    measurement_file_id: MeasurementFileId,
    /// Mean and standard deviation of each channel at 0, 1, ..., 100 % of the cycle from the heel strike of its leg,
    /// relative to the peak of walk 1.
    channels: Vec<CycleActivity>,
    /// Mean of each channel over the cycle, relative to the peak of walk 1.
    averages: Vec<f64>,
    /// EMG RMSE against walk 1, in total and for each channel. Null for walk 1.
    emg_rmse: Option<EmgRmse>,
}

impl From<lab::WalkActivity> for WalkActivity {
    fn from(activity: lab::WalkActivity) -> Self {
        let lab::WalkActivity { walk, measurement_file_id, channels, averages, emg_rmse } = activity;
        Self {
            walk,
            measurement_file_id,
            channels: channels.into_iter().map(Into::into).collect(),
            averages,
            emg_rmse: emg_rmse.map(Into::into),
        }
    }
}

/// Processed EMG recordings of a session.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct EmgResult {
    /// Settings of the filters.
    #[schema(value_type = document_schemas::EmgSettings)]
    settings: EmgSettings,
    /// Walks with an EMG recording.
    walks: Vec<WalkActivity>,
}

impl From<lab::EmgResult> for EmgResult {
    fn from(result: lab::EmgResult) -> Self {
        let lab::EmgResult { settings, walks } = result;
        Self { settings, walks: walks.into_iter().map(Into::into).collect() }
    }
}

/// Muscle activity of the model for a walk.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct WalkModel {
    /// Number of the walk, 2 or 3.
    walk: u8,
    /// Each channel whose muscle is in the model.
    muscles: Vec<ModelActivity>,
}

impl From<lab::WalkModel> for WalkModel {
    fn from(model: lab::WalkModel) -> Self {
        let lab::WalkModel { walk, muscles } = model;
        Self { walk, muscles: muscles.into_iter().map(Into::into).collect() }
    }
}

/// Processed EMG of a session, with the model's muscle activity.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ProcessedEmg {
    /// Measured activity.
    result: EmgResult,
    /// Muscle activity of the model. Empty while the session is blinded, and for gaits without muscles.
    model: Vec<WalkModel>,
}

impl From<lab::ProcessedEmg> for ProcessedEmg {
    fn from(view: lab::ProcessedEmg) -> Self {
        let lab::ProcessedEmg { result, model } = view;
        Self { result: result.into(), model: model.into_iter().map(Into::into).collect() }
    }
}
