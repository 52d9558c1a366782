//! Ground reaction forces.

use super::group::Group;
use super::leg_cycle::Cycle;
use super::legs::{CYCLE, of_legs};
use crate::Chart;
use crate::gait_series::Point;
use gait_optimizer::body::GRAVITY;

/// Ground reaction forces in body weights of the subject.
pub(super) fn forces(cycle: &Cycle<'_>, mass_kg: f64) -> Group {
    let weight = mass_kg * GRAVITY;
    let draw = |(title, axis): (&str, usize)| {
        let foot = |first: usize| move |p: &Point<'_>| (p.forces[first + axis] + p.forces[first + 2 + axis]) / weight;
        of_legs(cycle, Chart::new(title, CYCLE, "force / body weight"), foot(0), foot(4))
    };
    let charts = [("Vertical", 1), ("Forward", 0)].map(draw).into();
    let hint = "Sum of heel and toe, divided by the weight of the subject. Forward is positive: braking is below zero, propulsion above.";
    Group::new("forces", "Ground reaction forces", hint, charts)
}
