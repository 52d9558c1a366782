//! The strides of each leg, from its own heel strikes, and where the cycle of a channel begins.

use serde::{Deserialize, Serialize};

/// The heel strike at which the cycle of a channel begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CycleStart {
    /// Heel strike of the right foot.
    #[default]
    RightHeelStrike,
    /// Heel strike of the left foot, as recorded.
    LeftHeelStrike,
    /// Heel strike of the left foot, taken to be half a stride after the right one.
    AssumedLeftHeelStrike,
}

/// Start and end of the strides of each leg, s.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LegStrides {
    /// Between right heel strikes.
    pub right: Vec<(f64, f64)>,
    /// Between left heel strikes; `None`: not recorded.
    pub left: Option<Vec<(f64, f64)>>,
}

/// Whether a channel is on the left leg.
pub(super) fn is_left(channel: &str) -> bool {
    channel.ends_with("_L")
}
