//! Residuals of C5 to C12.

use super::checked_quantity::{CheckLocation, WorstValues};
use super::findings::{Findings, GridPoint};
use super::limits::{
    MUSCLE_FORCE as FORCE, MUSCLE_LENGTH as LENGTH, MUSCLE_RANGE as RANGE, MUSCLE_RESET as RESET,
    MUSCLE_TORQUE as TORQUE, MUSCLE_VELOCITY as VELOCITY,
};
use crate::gait::MuscleTrajectory;
use crate::gait::between_nodes::MuscleInstant;
use crate::muscle::{MUSCLE_COUNT, Muscle, force_length, force_velocity, tendon_force};
use crate::settings::GaitLimits;

/// Measures a grid point.
pub(super) fn add(
    point: &GridPoint<'_>,
    table: &[Muscle; MUSCLE_COUNT],
    muscles: &MuscleInstant,
    limits: &GaitLimits,
    worst: &mut Findings,
) {
    let (mut force_error, mut velocity_error, mut excess) = (0.0_f64, 0.0_f64, f64::NEG_INFINITY);
    let mut torque = [0.0; 4];
    for (m, muscle) in table.iter().enumerate() {
        let (length, velocity) = (muscles.fibre_length[m], muscles.fibre_velocity[m]);
        let tendon = muscle.unit_length(&point.instant.q) - length * muscle.optimal_length_m;
        let pulled = tendon_force(tendon / muscle.slack_length_m - 1.0).value;
        let made =
            muscles.activation[m] * force_length(length).value * force_velocity(velocity / muscle.max_speed).value;
        force_error = force_error.max((made - pulled).abs());
        velocity_error = velocity_error.max((muscles.fibre_length_rate[m] - velocity).abs());
        let activation = muscles.activation[m];
        excess = excess.max((-activation).max(activation - 1.0)).max(velocity.abs() / muscle.max_speed - 1.0);
        excess = excess.max(limits.fibre_length_min - length).max(length - limits.fibre_length_max);
        for attachment in muscle.attachments.iter().flatten() {
            let arm = attachment.at(point.instant.q[attachment.coordinate]).arm;
            torque[attachment.coordinate - 3] += arm * muscle.max_force_n * pulled;
        }
    }
    let torque_error = (0..4).map(|i| (point.instant.u[i] - torque[i]).abs()).fold(0.0, f64::max);
    worst.add(point, &FORCE, force_error);
    worst.add(point, &VELOCITY, velocity_error);
    worst.add(point, &TORQUE, torque_error);
    worst.add(point, &RANGE, excess);
}

/// Distance of the fibre lengths at a node from the cubic through the ends of its interval.
pub(super) fn add_interpolation_error(
    point: &GridPoint<'_>,
    written: &[f64; MUSCLE_COUNT],
    cubic: &[f64; MUSCLE_COUNT],
    worst: &mut Findings,
) {
    let apart = written.iter().zip(cubic).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    worst.add(point, &LENGTH, apart);
}

/// Continuity of the fibre lengths from one domain to the next.
pub(super) fn add_reset(
    before: &MuscleTrajectory,
    after: &MuscleTrajectory,
    place: CheckLocation<'_>,
    worst: &mut WorstValues,
) {
    if let (Some(last), Some(first)) = (before.fibre_length.last(), after.fibre_length.first()) {
        let jump = last.iter().zip(first).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        worst.add(RESET, jump, place);
    }
}
