//! Ten Hill-type muscles after Geyer and Herr 2010: table, length, moment arms, smoothed curves.

use crate::{Scalar, constant};
use std::f64::consts::PI;

/// A spanned joint: index in q, r0 (m), angle of the largest moment arm (degrees; hip: constant arm), reference angle
/// (degrees), rho, +1 for extensors and -1 for flexors.
pub(crate) type Joint = (usize, f64, Option<f64>, f64, f64, f64);

pub(crate) struct Muscle {
    /// N.
    pub(crate) force: f64,
    /// Optimal lengths per second.
    pub(crate) speed: f64,
    /// m.
    pub(crate) optimal: f64,
    /// m.
    pub(crate) slack: f64,
    pub(crate) joints: Vec<Joint>,
}

/// HAM, GLU, HFL, GAS, VAS, SOL, TA of the left leg, HAM, GLU, HFL of the right leg (hip only).
pub(crate) fn table() -> Vec<Muscle> {
    let muscle = |force, speed, optimal, slack, joints: Vec<Joint>| Muscle { force, speed, optimal, slack, joints };
    let ham_hip = |hip| (hip, 0.08, None, 155.0, 0.7, 1.0);
    let ham = |joints| muscle(3000.0, 12.0, 0.10, 0.31, joints);
    let glu = |hip| muscle(1500.0, 12.0, 0.11, 0.13, vec![(hip, 0.10, None, 150.0, 0.5, 1.0)]);
    let hfl = |hip| muscle(2000.0, 12.0, 0.11, 0.10, vec![(hip, 0.10, None, 180.0, 0.5, -1.0)]);
    vec![
        ham(vec![ham_hip(3), (4, 0.05, Some(180.0), 180.0, 0.7, -1.0)]),
        glu(3),
        hfl(3),
        muscle(
            1500.0,
            12.0,
            0.05,
            0.40,
            vec![(5, 0.05, Some(110.0), 80.0, 0.7, 1.0), (4, 0.05, Some(140.0), 165.0, 0.7, -1.0)],
        ),
        muscle(6000.0, 12.0, 0.08, 0.23, vec![(4, 0.06, Some(165.0), 125.0, 0.7, 1.0)]),
        muscle(4000.0, 6.0, 0.04, 0.26, vec![(5, 0.05, Some(110.0), 80.0, 0.5, 1.0)]),
        muscle(800.0, 12.0, 0.06, 0.24, vec![(5, 0.04, Some(80.0), 110.0, 0.7, -1.0)]),
        ham(vec![ham_hip(6)]),
        glu(6),
        hfl(6),
    ]
}

/// Geyer's joint angle: 180 degrees for a straight hip or knee, 90 for a neutral ankle.
fn geyer<D: Scalar>(coordinate: usize, angle: D) -> D {
    constant::<D>(if coordinate == 5 { PI / 2.0 } else { PI }) - angle
}

/// Contribution of a joint to the length of the muscle-tendon unit, m.
pub(crate) fn length_change<D: Scalar>(joint: &Joint, angle: D) -> D {
    let &(coordinate, r0, largest, reference, rho, direction) = joint;
    let phi = geyer(coordinate, angle);
    let reference = reference.to_radians();
    let change = match largest {
        None => (phi - reference) * (rho * r0),
        Some(largest) => {
            let largest = largest.to_radians();
            ((phi - largest).sin() - (reference - largest).sin()) * (rho * r0)
        }
    };
    -(change * direction)
}

/// Torque on the model's joint (flexion, dorsiflexion positive) per newton, m.
pub(crate) fn arm<D: Scalar>(joint: &Joint, angle: D) -> D {
    let &(coordinate, r0, largest, _, _, direction) = joint;
    let lever = match largest {
        None => constant(r0),
        Some(largest) => (geyer(coordinate, angle) - largest.to_radians()).cos() * r0,
    };
    -(lever * direction)
}

/// Force over fibre length / optimal length.
pub(crate) fn force_length<D: Scalar>(x: D) -> D {
    let y = (x - 1.0) / 0.56;
    (y * y * (y * y + 1e-6).sqrt() * 0.05_f64.ln()).exp()
}

/// Force over velocity / V, shortening negative.
pub(crate) fn force_velocity<D: Scalar>(nu: D) -> D {
    let r = (nu * nu + 0.01 * 0.01).sqrt();
    let (a, b) = ((nu - r) * 0.5, (nu + r) * 0.5);
    let one = constant::<D>(1.0);
    (one + a) / (one - a * 5.0) + 1.5 - (one - b) / (one + b * 37.8) * 0.5 - 1.0
}

/// Tendon force over strain.
pub(crate) fn tendon_force<D: Scalar>(strain: D) -> D {
    let taut = (strain + (strain * strain + 0.002 * 0.002).sqrt()) / (2.0 * 0.04);
    taut * taut
}

/// Tendon strain at a posture and fibre length.
pub(crate) fn strain<D: Scalar>(muscle: &Muscle, q: &[D; 9], fibre_length: D) -> D {
    let mut unit = constant::<D>(muscle.optimal + muscle.slack);
    for joint in &muscle.joints {
        unit += length_change(joint, q[joint.0]);
    }
    (unit - fibre_length * muscle.optimal - muscle.slack) / muscle.slack
}
