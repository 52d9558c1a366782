//! The heel strikes of both feet in an EMG recording.

/// Heel strikes of an EMG recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FootStrikes {
    /// Heel strikes of the right foot, s.
    pub right_s: Vec<f64>,
    /// Heel strikes of the left foot, s; `None`: not recorded.
    pub left_s: Option<Vec<f64>>,
}
