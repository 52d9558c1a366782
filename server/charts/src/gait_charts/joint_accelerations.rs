//! Joint accelerations.

use super::group::Group;
use super::leg_cycle::{Cycle, Leg};
use super::legs::{CYCLE, JOINTS, of_legs};
use crate::Chart;
use crate::gait_series::Point;

/// Index of the first joint of a leg in q.
fn hip(leg: Leg) -> usize {
    match leg {
        Leg::Left => 3,
        Leg::Right => 6,
    }
}

/// The acceleration of each joint, both legs in one chart.
pub(super) fn accelerations(cycle: &Cycle<'_>) -> Group {
    let draw = |(joint, title): (usize, &&str)| {
        let of = |leg| move |point: &Point<'_>| point.qdd[hip(leg) + joint].to_degrees();
        of_legs(cycle, Chart::new(title, CYCLE, "acceleration, \u{b0}/s\u{b2}"), of(Leg::Left), of(Leg::Right))
    };
    let hint = "Flexion and dorsiflexion are positive. Accelerations jump where the domain changes.";
    Group {
        is_folded: true,
        ..Group::new("accelerations", "Joint accelerations", hint, JOINTS.iter().enumerate().map(draw).collect())
    }
}
