//! Joint torques and powers, normalised to body mass.

use super::group::Group;
use super::leg_cycle::Cycle;
use super::legs::{CYCLE, JOINTS, of_legs};
use crate::Chart;
use crate::gait_series::Point;
use gait_optimizer::body::Side;

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
