//! Settings of an initial guess.

/// Stride time and length of an initial guess.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuessSettings {
    /// Stride time, s.
    pub stride_time_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
}

impl Default for GuessSettings {
    fn default() -> Self {
        Self { stride_time_s: 1.2, stride_length_m: 1.15 }
    }
}
