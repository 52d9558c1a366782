//! Envelopes.

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
    pub(super) fn at(&self, time_s: f64) -> f64 {
        let position = ((time_s - self.start_s) * self.rate_hz).clamp(0.0, (self.values.len() - 1) as f64);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // clamped to the indices
        let low = (position.floor() as usize).min(self.values.len() - 2);
        let share = position - low as f64;
        self.values[low] + share * (self.values[low + 1] - self.values[low])
    }
}
