//! The charts in which both legs are compared, as gait laboratories draw them: each leg over its own cycle, torques and
//! powers normalised to body mass, forces in body weights.

use super::group::Group;
use super::leg_cycle::{Cycle, Leg};
use crate::gait_series::Point;
use crate::{Chart, Stroke, band_in_words, over_reference_of_leg};
use gait_optimizer::ReferenceGait;
use gait_optimizer::body::{GRAVITY, Side};

const CYCLE: &str = "gait cycle from heel strike of each leg, %";
const JOINTS: [&str; 3] = ["Hip", "Knee", "Ankle"];
/// Title, and place among the muscles of the left and the right leg.
const MUSCLES: [(&str, usize, Option<usize>); 7] = [
    ("Hamstrings", 0, Some(7)),
    ("Gluteus", 1, Some(8)),
    ("Hip flexors", 2, Some(9)),
    ("Vasti", 4, None),
    ("Gastrocnemius", 3, None),
    ("Soleus", 5, None),
    ("Tibialis anterior", 6, None),
];

/// Both legs in one chart.
fn of_legs(
    cycle: &Cycle<'_>,
    chart: Chart,
    left: impl Fn(&Point<'_>) -> f64,
    right: impl Fn(&Point<'_>) -> f64,
) -> Chart {
    cycle.with_leg(cycle.with_leg(chart, Leg::Left, left), Leg::Right, right)
}

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
        "Flexion, dorsiflexion and forward lean are positive. Reference gait: {}. {} There is no reference for the joints of the prosthesis.",
        reference.name,
        band_in_words(reference)
    );
    Group::new("angles", "Joint angles", hint, charts)
}

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

/// Internal torques, positive in extension and plantarflexion.
pub(super) fn torques(cycle: &Cycle<'_>, mass_kg: f64) -> Group {
    let draw = |place: usize| {
        let torque = |joint: usize| move |p: &Point<'_>| -p.u[joint] / mass_kg;
        of_legs(cycle, Chart::new(JOINTS[place], CYCLE, "torque, N m/kg"), torque(place), torque(3 + place))
    };
    let hint = "Internal torques, normalised to the subject's body mass. Extension and plantarflexion are positive; angles and \
                exported files have the opposite sign. The prosthesis drives the right knee and ankle; the subject drives the other joints.";
    Group::new("torques", "Joint torques", hint, (0..3).map(draw).collect())
}

/// Power of each joint, the product of its torque and its velocity.
pub(super) fn powers(cycle: &Cycle<'_>, mass_kg: f64) -> Group {
    let draw = |place: usize| {
        let power = |side: Side, joint: usize| {
            let q = side.hip() + place;
            move |p: &Point<'_>| p.u[joint] * p.qd[q] / mass_kg
        };
        let chart = Chart::new(JOINTS[place], CYCLE, "power, W/kg");
        of_legs(cycle, chart, power(Side::Left, place), power(Side::Right, 3 + place))
    };
    let hint =
        "Normalised to the subject's body mass. A joint generates power above zero and absorbs power below zero.";
    Group::new("powers", "Joint powers", hint, (0..3).map(draw).collect())
}

/// Activation of each muscle. The right leg has only those of the residual limb.
pub(super) fn activations(cycle: &Cycle<'_>) -> Group {
    let activation = |p: &Point<'_>, muscle: usize| p.activation.map_or(f64::NAN, |all| all[muscle]);
    let mut charts = of_muscles(cycle, "activation, 0 to 1", activation);
    for chart in &mut charts {
        // From rest, so that a small ripple does not look like a burst.
        chart.y_range = Some((0.0, 0.1));
    }
    Group::new("muscles", "Muscle activation", "The right leg has the muscles of the residual limb.", charts)
}

/// Fibre length of each muscle.
pub(super) fn fibre_lengths(cycle: &Cycle<'_>) -> Group {
    let length = |p: &Point<'_>, muscle: usize| p.fibre_length.map_or(f64::NAN, |all| all[muscle]);
    let charts = of_muscles(cycle, "length / optimal length", length);
    Group::new("fibres", "Fibre lengths", "The force of a muscle is largest at its optimal fibre length.", charts)
}

/// A chart for each muscle.
fn of_muscles(cycle: &Cycle<'_>, unit: &str, state: fn(&Point<'_>, usize) -> f64) -> Vec<Chart> {
    let chart = |&(muscle, left, right): &(&str, usize, Option<usize>)| {
        let chart = cycle.with_leg(Chart::new(muscle, CYCLE, unit), Leg::Left, |p| state(p, left));
        match right {
            Some(right) => cycle.with_leg(chart, Leg::Right, |p| state(p, right)),
            None => chart,
        }
    };
    MUSCLES.iter().map(chart).collect()
}

/// Angle and velocity of each joint over the stride.
pub(super) fn portraits(cycle: &Cycle<'_>) -> Group {
    let (angle, velocity) = ("angle, °", "velocity, °/s");
    let with = |mut chart: Chart, label: &str, colour: usize, stroke: Stroke, q: usize| {
        chart.moments.push((colour, cycle.moments(q)));
        chart.with(label, colour, stroke, cycle.orbit(q))
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
    Group::new("portraits", "Limit cycles", hint, charts)
}
