//! What the charts share in which both legs are compared, as gait laboratories draw them: each leg over its own cycle.

use super::leg_cycle::{Cycle, Leg};
use crate::Chart;
use crate::gait_series::Point;

pub(super) const CYCLE: &str = "gait cycle from heel strike of each leg, %";
pub(super) const JOINTS: [&str; 3] = ["Hip", "Knee", "Ankle"];

/// Both legs in one chart.
pub(super) fn of_legs(
    cycle: &Cycle<'_>,
    chart: Chart,
    left: impl Fn(&Point<'_>) -> f64,
    right: impl Fn(&Point<'_>) -> f64,
) -> Chart {
    cycle.with_leg(cycle.with_leg(chart, Leg::Left, left), Leg::Right, right)
}
