//! Surface electromyograms (EMG): from raw signals to muscle activity over the gait cycle.
//!
//! 1. Zero-phase Butterworth band-pass, full-wave rectification, zero-phase Butterworth low-pass: [`Envelope`].
//! 2. Segmentation at heel strikes, mean of the strides at 101 points, normalisation by the peak of normal walking:
//!    [`CycleActivity`].
//! 3. Distance from normal walking: [`emg_rmse`].

mod activity;
mod cycle;
mod emg_recording;
mod model_activity;

pub use activity::Activity;
pub use cycle::{CycleActivity, EmgRmse, emg_rmse, is_plausible, strides_between};
pub use emg_recording::EmgRecording;
pub use model_activity::{ModelActivity, model_activity};

use crate::subject::ModelError;
use serde::{Deserialize, Serialize};

/// Channels of the experiment in the paper: rectus femoris, tibialis anterior, biceps femoris and gastrocnemius of the
/// intact leg, rectus femoris and biceps femoris of the residual limb.
pub const CHANNELS: [&str; 6] = ["RF_L", "TA_L", "BF_L", "GAS_L", "RF_R", "BF_R"];
/// Number of points of a gait cycle: 0, 1, ..., 100 %.
pub const CYCLE_POINTS: usize = 101;

/// Highest lower edge of the band-pass, and highest edge of the envelope, Hz.
const HIGHEST_LOW_HZ: f64 = 450.0;
/// Highest upper edge of the band-pass, Hz: muscles have no activity above it.
const HIGHEST_HZ: f64 = 1000.0;

/// Settings of the filters. The order is that of one pass and edge; forward and backward pass together have twice the
/// order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EmgSettings {
    /// Lower edge of the band-pass, Hz. Motion artefacts of cable and skin are below.
    pub band_low_hz: f64,
    /// Upper edge of the band-pass, Hz; below half the sampling rate.
    pub band_high_hz: f64,
    /// Edge of the low-pass for the envelope, Hz.
    pub envelope_hz: f64,
    /// Order of both filters: 2, 4, 6 or 8.
    pub order: usize,
}

impl Default for EmgSettings {
    fn default() -> Self {
        Self { band_low_hz: 20.0, band_high_hz: 450.0, envelope_hz: 6.0, order: 4 }
    }
}

impl EmgSettings {
    /// Checks the settings for signals with this sampling rate.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self, rate_hz: f64) -> Result<(), ModelError> {
        let half = 0.5 * rate_hz;
        let (low, high) = ((0.9 * half).min(HIGHEST_LOW_HZ), (0.99 * half).min(HIGHEST_HZ));
        ModelError::check_range("emg.band_low_hz", self.band_low_hz, 1.0, low)?;
        ModelError::check_range("emg.band_high_hz", self.band_high_hz, self.band_low_hz + 1.0, high)?;
        ModelError::check_range("emg.envelope_hz", self.envelope_hz, 0.5, low)?;
        ModelError::check_range("emg.order", self.order as f64, 2.0, 8.0)?;
        if self.order % 2 == 1 {
            return Err(ModelError::Unknown {
                field: "emg.order".to_owned(),
                value: self.order.to_string(),
                known: "2, 4, 6 or 8".to_owned(),
            });
        }
        Ok(())
    }
}

/// The envelope of one channel: its signal rectified and smoothed.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    /// Name of the channel.
    pub channel: String,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Samples per second.
    pub rate_hz: f64,
    /// Samples, in the unit of the recording.
    pub values: Vec<f64>,
}

impl Envelope {
    /// Time of the last sample, s.
    pub fn end_s(&self) -> f64 {
        self.start_s + (self.values.len() - 1) as f64 / self.rate_hz
    }

    /// The value at a time of the recording, interpolated linearly.
    fn at(&self, time_s: f64) -> f64 {
        let position = ((time_s - self.start_s) * self.rate_hz).clamp(0.0, (self.values.len() - 1) as f64);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // clamped to the indices
        let low = (position.floor() as usize).min(self.values.len() - 2);
        let share = position - low as f64;
        self.values[low] + share * (self.values[low + 1] - self.values[low])
    }
}
