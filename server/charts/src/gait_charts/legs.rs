//! Common parts of the charts that compare both legs, as gait laboratories draw them: each leg over its own cycle.

use super::leg_cycle::{Cycle, Leg};
use crate::Chart;
use crate::gait_series::Point;

pub(super) const CYCLE: &str = "gait cycle from heel strike of each leg, %";
pub(super) const JOINTS: [&str; 3] = ["Hip", "Knee", "Ankle"];
/// The joints of both legs: title of a chart of this joint alone, leg, and place in [`JOINTS`].
pub(super) const JOINTS_OF_LEGS: [(&str, Leg, usize); 6] = [
    ("Left hip", Leg::Left, 0),
    ("Right hip", Leg::Right, 0),
    ("Left knee", Leg::Left, 1),
    ("Right knee (prosthesis)", Leg::Right, 1),
    ("Left ankle", Leg::Left, 2),
    ("Right ankle (prosthesis)", Leg::Right, 2),
];

/// The axis of a chart of one leg.
pub(super) fn cycle_of_leg(leg: Leg) -> String {
    format!("gait cycle from {} heel strike, %", leg.name())
}

/// Both legs in one chart.
pub(super) fn of_legs(
    cycle: &Cycle<'_>,
    chart: Chart,
    left: impl Fn(&Point<'_>) -> f64,
    right: impl Fn(&Point<'_>) -> f64,
) -> Chart {
    cycle.with_leg(cycle.with_leg(chart, Leg::Left, left), Leg::Right, right)
}
