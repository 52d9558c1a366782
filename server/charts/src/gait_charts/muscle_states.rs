//! Activations, forces and fibre lengths of the muscles.

use super::group::Group;
use super::leg_cycle::{Cycle, Leg};
use super::legs::CYCLE;
use crate::Chart;
use crate::gait_series::Point;
use gait_optimizer::Gait;
use gait_optimizer::body::GRAVITY;
use gait_optimizer::muscle::tendon_force;

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

/// Force of each muscle, that of its tendon.
pub(super) fn forces(cycle: &Cycle<'_>, gait: &Gait) -> Group {
    let muscles = gait.settings.muscles.muscles(&gait.subject);
    let weight_n = gait.subject.body_mass_kg * GRAVITY;
    let force = |p: &Point<'_>, muscle: usize| {
        let (Some(fibre), Some(unit)) = (p.fibre_length, muscles.get(muscle)) else { return f64::NAN };
        let tendon_m = unit.unit_length(p.q) - fibre[muscle] * unit.optimal_length_m;
        unit.max_force_n * tendon_force(tendon_m / unit.slack_length_m - 1.0).value / weight_n
    };
    let mut charts = of_muscles(cycle, "force, body weight", force);
    for chart in &mut charts {
        chart.y_range = Some((0.0, 0.1));
    }
    let hint = "The force of each muscle, which its tendon transmits, normalised to body weight.";
    Group::new("muscle-forces", "Muscle forces", hint, charts)
}

/// Fibre length of each muscle.
pub(super) fn fibre_lengths(cycle: &Cycle<'_>) -> Group {
    let length = |p: &Point<'_>, muscle: usize| p.fibre_length.map_or(f64::NAN, |all| all[muscle]);
    let charts = of_muscles(cycle, "length / optimal length", length);
    Group::new("fibres", "Fibre lengths", "The force of a muscle is largest at its optimal fibre length.", charts)
}

/// A chart for each muscle.
fn of_muscles(cycle: &Cycle<'_>, unit: &str, state: impl Fn(&Point<'_>, usize) -> f64) -> Vec<Chart> {
    let chart = |&(muscle, left, right): &(&str, usize, Option<usize>)| {
        let chart = cycle.with_leg(Chart::new(muscle, CYCLE, unit), Leg::Left, |p| state(p, left));
        match right {
            Some(right) => cycle.with_leg(chart, Leg::Right, |p| state(p, right)),
            None => chart,
        }
    };
    MUSCLES.iter().map(chart).collect()
}
