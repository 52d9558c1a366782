//! Cuts a recording into strides at its heel strikes.

use super::heel_strikes::ROUNDING_S;
use super::motion_recording::MotionRecording;

/// Durations of valid strides, s.
pub const STRIDE_RANGE_S: (f64, f64) = (0.8, 1.6);
/// Longest gap between two rows of a valid stride, s.
pub(super) const MAX_GAP_S: f64 = 0.1;
/// The strides between successive heel strikes, s.
pub fn strides_between(heel_strikes_s: &[f64]) -> Vec<(f64, f64)> {
    heel_strikes_s.windows(2).map(|pair| (pair[0], pair[1])).collect()
}

/// Whether a stride, s, lasts as long as strides do.
pub fn is_plausible((start, end): (f64, f64)) -> bool {
    (STRIDE_RANGE_S.0..=STRIDE_RANGE_S.1).contains(&(end - start))
}

/// A stride of a recording, between two right heel strikes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedStride {
    /// Right heel strike at its start, s.
    pub start_s: f64,
    /// Right heel strike at its end, s.
    pub end_s: f64,
    /// Whether it is averaged: it lasts as long as strides do, and has no gaps.
    pub is_used: bool,
}

impl MotionRecording {
    /// The strides between heel strikes.
    pub fn strides(&self, strikes: &[f64]) -> Vec<RecordedStride> {
        let stride = |(start_s, end_s)| {
            let is_used = is_plausible((start_s, end_s)) && self.is_whole(start_s, end_s);
            RecordedStride { start_s, end_s, is_used }
        };
        strides_between(strikes).into_iter().map(stride).collect()
    }

    /// Whether there is no gap between two times.
    fn is_whole(&self, start: f64, end: f64) -> bool {
        self.time_s
            .windows(2)
            .all(|pair| pair[1] <= start || pair[0] >= end || pair[1] - pair[0] <= MAX_GAP_S + ROUNDING_S)
    }
}
