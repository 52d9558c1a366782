//! The charts of a gait.

mod group;
mod leg_cycle;
mod legs;
mod solve_charts;

pub use group::Group;
pub use solve_charts::solve;

use crate::{Animation, Chart, Figure, GaitWalker, LegCycle, Stroke, over_reference};
use gait_optimizer::gait::stick_figure::StickFigure;
use gait_optimizer::gait::{PhaseProgress, progress};
use gait_optimizer::{Gait, ModelError, ReferenceGait};
use leg_cycle::Cycle;

/// The phases of the stride, in their order, for either leg.
pub const PHASES: [(&str, &str); 4] = [
    ("DS2", "double support: heel of the leading foot and toe of the trailing foot on the ground"),
    ("DS3", "double support: leading foot flat, toe of the trailing foot still on the ground"),
    ("SS2", "single support on the flat foot while the other leg swings"),
    ("SS1", "single support on the toe until the other heel strikes"),
];

const CYCLE: &str = "gait cycle from right heel strike, %";
/// Title and index into q and into the reference of the five human coordinates.
const ANGLES: [(&str, usize, usize); 5] =
    [("Torso lean", 2, 0), ("Left hip", 3, 1), ("Left knee", 4, 2), ("Left ankle", 5, 3), ("Right hip", 6, 4)];
/// Names of q, apart from the place of the hip.
const COORDINATES: [&str; 7] =
    ["Torso lean", "Left hip", "Left knee", "Left ankle", "Right hip", "Right knee", "Right ankle"];

/// Number of drawn points for each node of a gait.
const DRAWN_PARTS: usize = 6;

/// A gait as it is drawn: smooth between its nodes.
fn drawn(gait: &Gait) -> Gait {
    gait.refined(DRAWN_PARTS)
}

/// The gait as a picture that moves, for download.
pub fn animation(walker: GaitWalker) -> Figure {
    Figure::animation("Walking", Animation::new(walker))
}

/// The stride as a row of pictures.
pub fn tiles(figures: Vec<StickFigure>) -> Figure {
    Figure::tiles("The stride", figures)
}

/// All figures of a gait.
///
/// # Errors
/// When its subject or device is invalid.
pub fn of_gait(gait: &Gait, reference: &ReferenceGait) -> Result<Vec<Group>, ModelError> {
    let gait = &drawn(gait);
    let cycle = Cycle::of(gait);
    let mass_kg = gait.subject.body_mass_kg;
    let mut groups = vec![
        legs::angles(&cycle, reference),
        legs::forces(&cycle, mass_kg),
        legs::torques(&cycle, mass_kg),
        legs::powers(&cycle, mass_kg),
    ];
    if gait.muscles {
        groups.push(legs::activations(&cycle));
        groups.push(legs::fibre_lengths(&cycle));
    }
    groups.push(progress_of(&cycle, gait)?);
    groups.push(legs::portraits(&cycle));
    Ok(groups)
}

/// Phase and hip velocity, which the virtual constraints control in most domains.
fn progress_of(cycle: &Cycle<'_>, gait: &Gait) -> Result<Group, ModelError> {
    let made = progress(gait)?;
    let over = |value: fn(&PhaseProgress) -> f64| {
        let mut values = made.iter();
        cycle.over(|_| values.next().map_or(f64::NAN, value))
    };
    let velocity = Chart::new("Hip velocity", CYCLE, "velocity, m/s")
        .with("linearised", 0, Stroke::Solid, over(|point| point.hip_velocity_m_s))
        .with("hip", 1, Stroke::Dashed, cycle.over(|point| point.qd[0]));
    let phase =
        Chart::new("Phase", CYCLE, "phase variable, 0 to 1").with("phase", 0, Stroke::Solid, over(|point| point.phase));
    let charts = vec![cycle.marked(velocity), cycle.marked(phase)];
    let hint = "The phase replaces time: it rises from 0 at the planned start of a domain to 1 at its planned end, in proportion \
                to the linearised position of the hip over the stance toe. Its velocity is constant in all domains but SS1.";
    Ok(Group::new("phase", "Hip velocity and phase", hint, charts))
}

/// The joint angles of a reference alone: title and chart.
pub fn of_reference(reference: &ReferenceGait) -> Vec<Chart> {
    let chart = |&(title, _, column): &(&str, usize, usize)| {
        over_reference(Chart::new(title, CYCLE, "angle, °"), reference, column)
    };
    ANGLES.iter().map(chart).collect()
}

/// The human joint angles of gaits and of a reference. Each gait comes with its name.
pub fn with_reference(gaits: &[(&str, &Gait)], reference: &ReferenceGait) -> Vec<Chart> {
    let gaits: Vec<(&str, Gait)> = gaits.iter().map(|(name, gait)| (*name, drawn(gait))).collect();
    let draw = |&(title, q, column): &(&str, usize, usize)| {
        let mut chart = over_reference(Chart::new(title, CYCLE, "angle, °"), reference, column);
        chart.cycles = vec![LegCycle { colour: None, begins_percent: 0.0, toe_off_percent: None }];
        for (place, (name, gait)) in gaits.iter().enumerate() {
            chart = chart.with(name, place, stroke(place), Cycle::of(gait).over(|p| p.q[q].to_degrees()));
        }
        chart
    };
    ANGLES.iter().map(draw).collect()
}

/// The orbits of each joint, with the orbits of all gaits in one chart. Each gait comes with its name.
pub fn orbits(gaits: &[(&str, &Gait)]) -> Vec<Chart> {
    let gaits: Vec<(&str, Gait)> = gaits.iter().map(|(name, gait)| (*name, drawn(gait))).collect();
    let draw = |(place, title): (usize, &&str)| {
        let mut chart = Chart::new(title, "angle, °", "velocity, °/s");
        for (colour, (name, gait)) in gaits.iter().enumerate() {
            chart = chart.with(name, colour, stroke(colour), Cycle::of(gait).orbit(place + 2));
        }
        chart
    };
    if gaits.is_empty() { Vec::new() } else { COORDINATES.iter().enumerate().map(draw).collect() }
}

/// The orbit of a coordinate of a gait, °, °/s.
pub fn orbit(gait: &Gait, coordinate: usize) -> Vec<(f64, f64)> {
    Cycle::of(&drawn(gait)).orbit(coordinate)
}

/// Stroke of a gait: solid for the first one, dashed for the others.
fn stroke(place: usize) -> Stroke {
    if place == 0 { Stroke::Solid } else { Stroke::Dashed }
}
