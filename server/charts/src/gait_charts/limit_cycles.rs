//! Limit cycles: angle and velocity of each coordinate over the stride.

use super::drawn_gait::{drawn, stroke};
use super::group::Group;
use super::leg_cycle::{Cycle, Leg};
use super::legs::JOINTS;
use crate::{Chart, Stroke};
use gait_optimizer::Gait;
use gait_optimizer::body::Side;

/// Names of q, apart from the place of the hip.
const COORDINATES: [&str; 7] =
    ["Torso lean", "Left hip", "Left knee", "Left ankle", "Right hip", "Right knee", "Right ankle"];

/// Angle and velocity of each joint over the stride.
pub(super) fn limit_cycle_group(cycle: &Cycle<'_>) -> Group {
    let (angle, velocity) = ("angle, °", "velocity, °/s");
    let with = |mut chart: Chart, label: &str, colour: usize, stroke: Stroke, q: usize| {
        chart.moments.push((colour, cycle.moments(q)));
        chart.with(label, colour, stroke, cycle.limit_cycle(q))
    };
    let joint = |(place, title): (usize, &&str)| {
        [(Leg::Left, Side::Left), (Leg::Right, Side::Right)]
            .into_iter()
            .fold(Chart::new(title, angle, velocity), |chart, (leg, side)| {
                with(chart, leg.label(), leg.colour(), leg.stroke(), side.hip() + place)
            })
    };
    let mut charts: Vec<Chart> = JOINTS.iter().enumerate().map(joint).collect();
    charts.push(with(Chart::new("Torso lean", angle, velocity), "torso", 7, Stroke::Solid, 2));
    let hint = "Joint angle and velocity over the stride. A closed curve is a periodic motion; a gap is an impact.";
    Group::new("limit-cycles", "Limit cycles", hint, charts)
}

/// The limit cycles of each joint, with the limit cycles of all gaits in one chart. Each gait comes with its name.
pub fn limit_cycles(gaits: &[(&str, &Gait)]) -> Vec<Chart> {
    let gaits: Vec<(&str, Gait)> = gaits.iter().map(|(name, gait)| (*name, drawn(gait))).collect();
    let draw = |(place, title): (usize, &&str)| {
        let mut chart = Chart::new(title, "angle, °", "velocity, °/s");
        for (colour, (name, gait)) in gaits.iter().enumerate() {
            chart = chart.with(name, colour, stroke(colour), Cycle::of(gait).limit_cycle(place + 2));
        }
        chart
    };
    if gaits.is_empty() { Vec::new() } else { COORDINATES.iter().enumerate().map(draw).collect() }
}

/// The limit cycle of a coordinate of a gait, °, °/s.
pub fn limit_cycle(gait: &Gait, coordinate: usize) -> Vec<(f64, f64)> {
    Cycle::of(&drawn(gait)).limit_cycle(coordinate)
}
