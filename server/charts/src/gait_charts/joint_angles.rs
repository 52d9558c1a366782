//! Joint angles with the reference gait.

use super::drawn_gait::{STRIDE, drawn, stroke};
use super::group::Group;
use super::leg_cycle::{Cycle, Leg};
use super::legs::{CYCLE, JOINTS, of_legs};
use crate::gait_series::Point;
use crate::{Chart, LegCycle, band_in_words, over_reference, over_reference_of_leg};
use gait_optimizer::body::Side;
use gait_optimizer::{Gait, ReferenceGait};

/// Title and index into q and into the reference of the five human coordinates.
const ANGLES: [(&str, usize, usize); 5] =
    [("Torso lean", 2, 0), ("Left hip", 3, 1), ("Left knee", 4, 2), ("Left ankle", 5, 3), ("Right hip", 6, 4)];
/// Torso, hip, knee and ankle. The reference has three joints of the left leg and the right hip.
pub(super) fn angles(cycle: &Cycle<'_>, reference: &ReferenceGait) -> Group {
    let over = |title: &str, references: &[(Leg, usize)]| {
        references.iter().fold(Chart::new(title, CYCLE, "angle, °"), |chart, &(leg, column)| {
            let name = if leg == Leg::Left { "left" } else { "right" };
            over_reference_of_leg(chart, reference, column, (leg.colour(), name), cycle.strike_percent(leg))
        })
    };
    let joint = |place: usize, references: &[(Leg, usize)]| {
        let angle = |side: Side| move |p: &Point<'_>| p.q[side.hip() + place].to_degrees();
        of_legs(cycle, over(JOINTS[place], references), angle(Side::Left), angle(Side::Right))
    };
    let torso = |p: &Point<'_>| p.q[2].to_degrees();
    let charts = vec![
        joint(0, &[(Leg::Left, 1), (Leg::Right, 4)]),
        joint(1, &[(Leg::Left, 2)]),
        joint(2, &[(Leg::Left, 3)]),
        of_legs(cycle, over("Torso lean", &[(Leg::Right, 0)]), torso, torso),
    ];
    let hint = format!(
        "Flexion, dorsiflexion and forward lean are positive. Torso lean is drawn over the cycle of each leg. Reference gait: {}. {} There is no reference for the joints of the prosthesis.",
        reference.name,
        band_in_words(reference)
    );
    Group::new("angles", "Joint angles", hint, charts)
}

/// The joint angles of a reference alone: title and chart.
pub fn of_reference(reference: &ReferenceGait) -> Vec<Chart> {
    let chart = |&(title, _, column): &(&str, usize, usize)| {
        over_reference(Chart::new(title, STRIDE, "angle, °"), reference, column)
    };
    ANGLES.iter().map(chart).collect()
}

/// The human joint angles of gaits and of a reference. Each gait comes with its name.
pub fn with_reference(gaits: &[(&str, &Gait)], reference: &ReferenceGait) -> Vec<Chart> {
    let gaits: Vec<(&str, Gait)> = gaits.iter().map(|(name, gait)| (*name, drawn(gait))).collect();
    let draw = |&(title, q, column): &(&str, usize, usize)| {
        let mut chart = over_reference(Chart::new(title, STRIDE, "angle, °"), reference, column);
        chart.cycles = vec![LegCycle { colour: None, begins_percent: 0.0, toe_off_percent: None }];
        for (place, (name, gait)) in gaits.iter().enumerate() {
            chart = chart.with(name, place, stroke(place), Cycle::of(gait).over(|p| p.q[q].to_degrees()));
        }
        chart
    };
    ANGLES.iter().map(draw).collect()
}
