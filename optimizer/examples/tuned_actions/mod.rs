//! Levels of the tuned bounds.

use gait_optimizer::TunedBounds;

/// Levels of Table I (Li et al. 2022).
#[allow(dead_code)] // each example takes what it needs
pub(crate) const LEVELS: [&[f64]; TunedBounds::COUNT] = [
    &[15.0, 20.0],
    &[70.0, 80.0, 90.0],
    &[0.3, 0.4, 0.5],
    &[1.2, 1.3, 1.4],
    &[0.0, 0.013, 0.026, 0.039],
    &[0.0, 0.1, 0.2, 0.3, 0.4, 0.5],
    &[20.0, 35.0, 50.0],
    &[20.0, 30.0, 40.0],
];

/// Values far beyond Table I.
#[allow(dead_code)] // each example takes what it needs
pub(crate) const TIGHT: [&[f64]; TunedBounds::COUNT] = [
    &[2.0, 3.0, 4.0],
    &[10.0, 20.0, 30.0],
    &[1.5, 2.0],
    &[0.35, 0.5],
    &[0.15, 0.2, 0.3],
    &[0.0, 0.02],
    &[5.0, 10.0],
    &[5.0, 8.0],
];
