//! The start of a solve: cold from x, or warm from a primal-dual point.

use serde::{Deserialize, Serialize};

/// A primal-dual point; lengths as in [`NlpResult`](crate::NlpResult), whose sign convention it shares.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct WarmPoint {
    /// x (length n).
    pub x: Vec<f64>,
    /// y (length m).
    pub row_multipliers: Vec<f64>,
    /// z_L (length n).
    pub lower_multipliers: Vec<f64>,
    /// z_U (length n).
    pub upper_multipliers: Vec<f64>,
    /// Slacks of the rows (length m); empty: g(x).
    pub slacks: Vec<f64>,
    /// Multipliers of the slacks' lower bounds (length m); empty: max(-y, 0).
    pub slack_lower_multipliers: Vec<f64>,
    /// Multipliers of the slacks' upper bounds (length m); empty: max(y, 0).
    pub slack_upper_multipliers: Vec<f64>,
}

/// Start of a solve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartPoint {
    /// x, pushed away from its bounds, with least-squares row multipliers.
    Cold(Vec<f64>),
    /// A primal-dual point, changed only by the small pushes of a warm start.
    Warm(WarmPoint),
}
