//! Surface electromyograms: from raw signals to activity over the gait cycle.
//!
//! The chain: zero-phase Butterworth band-pass, full-wave rectification, zero-phase Butterworth low-pass ([`Envelope`]);
//! cut at heel strikes, mean of strides at 101 points, division by the peak of normal walking ([`CycleActivity`]);
//! distance of two gaits ([`emg_rmse`]).

mod butterworth;
mod cycle;
mod zero_phase;

pub use cycle::{CycleActivity, emg_rmse};

use crate::subject::ModelError;
use crate::table::{Separator, Table, malformed};
use serde::{Deserialize, Serialize};

/// Points of a cycle: 0, 1, ..., 100 %.
pub const CYCLE_POINTS: usize = 101;
/// Largest deviation of a sample from its place on an even grid, sampling intervals.
const UNEVENNESS: f64 = 0.5;

/// Filters of the chain. Orders are those of one pass, per edge; both passes together have twice as many.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EmgSettings {
    /// Lower edge of the band-pass, Hz: below are movements of cable and skin.
    pub band_low_hz: f64,
    /// Upper edge of the band-pass, Hz; below half the sampling rate.
    pub band_high_hz: f64,
    /// Edge of the low-pass that makes the envelope, Hz.
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
    /// Checks the settings for signals of a sampling rate.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] naming the field.
    pub fn validate(&self, rate_hz: f64) -> Result<(), ModelError> {
        let half = 0.5 * rate_hz;
        ModelError::check_range("emg.band_low_hz", self.band_low_hz, 1.0, 0.9 * half)?;
        ModelError::check_range("emg.band_high_hz", self.band_high_hz, self.band_low_hz + 1.0, 0.99 * half)?;
        ModelError::check_range("emg.envelope_hz", self.envelope_hz, 0.5, 0.9 * half)?;
        ModelError::check_range("emg.order", self.order as f64, 2.0, 8.0)?;
        if self.order % 2 == 1 {
            return Err(ModelError::Unknown {
                field: "emg.order".to_owned(),
                value: self.order.to_string(),
                known: "2, 4, 6, 8".to_owned(),
            });
        }
        Ok(())
    }
}

/// Raw signals of several channels over the same time.
#[derive(Debug, Clone, PartialEq)]
pub struct EmgRecording {
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Samples per second.
    pub rate_hz: f64,
    /// Name and samples of each channel.
    pub channels: Vec<(String, Vec<f64>)>,
}

impl EmgRecording {
    /// A table with `time_s` and one column per channel, evenly sampled.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_csv(what: &str, text: &str) -> Result<Self, ModelError> {
        let lines: Vec<&str> = text.lines().collect();
        let comments = lines.iter().take_while(|line| line.starts_with('#')).count();
        let first_line = comments + 1;
        let table = Table::read(what, &lines[comments..], first_line, Separator::Comma, "time_s")?;
        let times = table.times();
        let (start_s, end_s) = (times[0], times[times.len() - 1]);
        let rate_hz = (times.len() - 1) as f64 / (end_s - start_s);
        let uneven = |(k, time): (usize, &f64)| ((time - start_s) * rate_hz - k as f64).abs() > UNEVENNESS;
        if let Some(k) = times.iter().enumerate().position(uneven) {
            let reason = format!("{} s is not on an even grid of {rate_hz:.3} samples per second", times[k]);
            return Err(malformed(what, first_line + 1 + k, Some(1), reason));
        }
        let channels: Vec<(String, Vec<f64>)> =
            table.names().iter().skip(1).filter_map(|name| Some((name.clone(), table.find(name)?))).collect();
        if channels.is_empty() {
            return Err(malformed(what, first_line, None, "there is no channel beside time_s".to_owned()));
        }
        Ok(Self { start_s, rate_hz, channels })
    }

    /// The envelope of every channel.
    ///
    /// # Errors
    /// [`ModelError`] naming a setting out of range, or when the recording is too short to be filtered.
    pub fn envelopes(&self, settings: &EmgSettings) -> Result<Vec<Envelope>, ModelError> {
        settings.validate(self.rate_hz)?;
        let share = |hz: f64| hz / (0.5 * self.rate_hz);
        let band = butterworth::band_pass(settings.order, share(settings.band_low_hz), share(settings.band_high_hz));
        let smooth = butterworth::low_pass(settings.order, share(settings.envelope_hz));
        let fewest = zero_phase::extension(&band) + 1;
        self.channels
            .iter()
            .map(|(channel, samples)| {
                if samples.len() < fewest {
                    let reason = format!("{} samples, the filters need {fewest}", samples.len());
                    return Err(ModelError::Malformed { what: format!("channel {channel}"), reason });
                }
                let rectified: Vec<f64> = zero_phase::filter(&band, samples).into_iter().map(f64::abs).collect();
                let values = zero_phase::filter(&smooth, &rectified);
                Ok(Envelope { channel: channel.clone(), start_s: self.start_s, rate_hz: self.rate_hz, values })
            })
            .collect()
    }
}

/// The smoothed, rectified signal of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    /// Name of the channel.
    pub channel: String,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Samples per second.
    pub rate_hz: f64,
    /// In the unit of the recording.
    pub values: Vec<f64>,
}

impl Envelope {
    /// Time of the last sample, s.
    pub fn end_s(&self) -> f64 {
        self.start_s + (self.values.len() - 1) as f64 / self.rate_hz
    }

    /// The value at a time within the recording, linear between samples.
    fn at(&self, time_s: f64) -> f64 {
        let position = ((time_s - self.start_s) * self.rate_hz).clamp(0.0, (self.values.len() - 1) as f64);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // clamped to the indices
        let low = (position.floor() as usize).min(self.values.len() - 2);
        let share = position - low as f64;
        self.values[low] + share * (self.values[low + 1] - self.values[low])
    }
}
