//! Rows of C5 to C7 and C9 to C12.
//!
//! C5 to C7 are the force equilibrium of fibre and tendon, `s f_l(l_ce) f_v(v_ce) = f_se(e)`, with the tendon strain e
//! from the posture. C9 to C12 equate joint torques and muscle torques (divided by 100).

use super::layout::{DomainLayout, PointVariables, Q, U};
use super::program_data::GaitProgram;
use super::rows::PointRows;
use super::sparse_entries::Entries;
use crate::muscle::attachment::AttachmentValue;
use crate::muscle::{CurveValue, MUSCLE_COUNT, Muscle, force_length, force_velocity, tendon_force};

const TORQUE_SCALE: f64 = 1.0 / 100.0;

/// Curves and geometry of a muscle at a node.
struct MuscleState {
    length: CurveValue,
    velocity: CurveValue,
    tendon: CurveValue,
    /// d(strain)/d(fibre length).
    strain_by_length: f64,
    /// Coordinate and geometry of each spanned joint.
    joints: [Option<(usize, AttachmentValue)>; 2],
    slack: f64,
    max_force: f64,
    max_speed: f64,
}

fn muscle_state(muscle: &Muscle, m: usize, point: &PointVariables) -> MuscleState {
    let joints = muscle
        .attachments
        .map(|a| a.map(|attachment| (attachment.coordinate, attachment.at(point.q[attachment.coordinate]))));
    let change: f64 = joints.iter().flatten().map(|(_, value)| value.length).sum();
    let slack = muscle.slack_length_m;
    // l_se - l_slack = l_mtu - l_ce - l_slack = l_opt (1 - x) + change
    let strain = (muscle.optimal_length_m * (1.0 - point.fibre_length[m]) + change) / slack;
    MuscleState {
        length: force_length(point.fibre_length[m]),
        velocity: force_velocity(point.fibre_velocity[m] / muscle.max_speed),
        tendon: tendon_force(strain),
        strain_by_length: -muscle.optimal_length_m / slack,
        joints,
        slack,
        max_force: muscle.max_force_n,
        max_speed: muscle.max_speed,
    }
}

/// Torque row of a coordinate: 0 hip_L, 1 knee_L, 2 ankle_L, 3 hip_R.
const fn torque_row(coordinate: usize) -> usize {
    coordinate - 3
}

/// Values.
pub(super) fn values(program: &GaitProgram, rows: &PointRows, point: &PointVariables, g: &mut [f64]) {
    let (Some(force), Some(torque)) = (rows.muscle_force, rows.muscle_torque) else { return };
    let mut driven = [0.0; 4];
    for m in 0..MUSCLE_COUNT {
        let state = muscle_state(&program.muscles[m], m, point);
        g[force + m] = point.activation[m] * state.length.value * state.velocity.value - state.tendon.value;
        for (coordinate, joint) in state.joints.iter().flatten() {
            driven[torque_row(*coordinate)] += joint.arm * state.max_force * state.tendon.value;
        }
    }
    for i in 0..4 {
        g[torque + i] = TORQUE_SCALE * (point.u[i] - driven[i]);
    }
}

/// Jacobian.
pub(super) fn jacobian(
    program: &GaitProgram,
    layout: &DomainLayout,
    rows: &PointRows,
    point: &PointVariables,
    p: usize,
    out: &mut Entries<'_>,
) {
    let (Some(force), Some(torque)) = (rows.muscle_force, rows.muscle_torque) else { return };
    for i in 0..4 {
        out.jacobian(torque + i, p + U + i, TORQUE_SCALE);
    }
    for m in 0..MUSCLE_COUNT {
        let state = muscle_state(&program.muscles[m], m, point);
        let (fl, fv, fse) = (state.length, state.velocity, state.tendon);
        let s = point.activation[m];
        let row = force + m;
        let length = p + layout.fibre_length() + m;
        out.jacobian(row, p + layout.activation() + m, fl.value * fv.value);
        out.jacobian(row, length, s * fl.first * fv.value - fse.first * state.strain_by_length);
        out.jacobian(row, p + layout.fibre_velocity() + m, s * fl.value * fv.first / state.max_speed);
        for (coordinate, joint) in state.joints.iter().flatten() {
            out.jacobian(row, p + Q + coordinate, -fse.first * joint.length_first / state.slack);
        }
        for (coordinate, joint) in state.joints.iter().flatten() {
            let torque_row = torque + torque_row(*coordinate);
            let scale = -TORQUE_SCALE * state.max_force;
            out.jacobian(torque_row, length, scale * joint.arm * fse.first * state.strain_by_length);
            for (other, by) in state.joints.iter().flatten() {
                let own = if other == coordinate { joint.arm_first * fse.value } else { 0.0 };
                let through_strain = joint.arm * fse.first * by.length_first / state.slack;
                out.jacobian(torque_row, p + Q + other, scale * (own + through_strain));
            }
        }
    }
}

/// Hessian.
pub(super) fn hessian(
    program: &GaitProgram,
    layout: &DomainLayout,
    rows: &PointRows,
    point: &PointVariables,
    p: usize,
    multipliers: &[f64],
    out: &mut Entries<'_>,
) {
    let (Some(force), Some(torque)) = (rows.muscle_force, rows.muscle_torque) else { return };
    for m in 0..MUSCLE_COUNT {
        let state = muscle_state(&program.muscles[m], m, point);
        let (fl, fv, fse) = (state.length, state.velocity, state.tendon);
        let s = point.activation[m];
        let weight = multipliers[force + m];
        let inverse_speed = 1.0 / state.max_speed;
        let activation = p + layout.activation() + m;
        let length = p + layout.fibre_length() + m;
        let velocity = p + layout.fibre_velocity() + m;
        out.hessian(activation, length, weight * fl.first * fv.value);
        out.hessian(activation, velocity, weight * fl.value * fv.first * inverse_speed);
        out.hessian(velocity, length, weight * s * fl.first * fv.first * inverse_speed);
        out.hessian(velocity, velocity, weight * s * fl.value * fv.second * inverse_speed * inverse_speed);
        // The tendon force has the coefficient -1 in its own row and -arm F_max in the torque rows. Its part of the
        // Lagrangian is W(q) f_se(e(x, q)) with W(q) = -weight - sum_i scale mu_i arm_i(q_i).
        let scale = -TORQUE_SCALE * state.max_force;
        let mut w = -weight;
        for (coordinate, joint) in state.joints.iter().flatten() {
            w += scale * multipliers[torque + torque_row(*coordinate)] * joint.arm;
        }
        let by_length = state.strain_by_length;
        out.hessian(length, length, weight * s * fl.second * fv.value + w * fse.second * by_length * by_length);
        let inverse_slack = 1.0 / state.slack;
        for (i, (coordinate, joint)) in state.joints.iter().flatten().enumerate() {
            let mu = scale * multipliers[torque + torque_row(*coordinate)];
            let strain_first = joint.length_first * inverse_slack;
            out.hessian(
                p + Q + coordinate,
                length,
                w * fse.second * by_length * strain_first + mu * joint.arm_first * fse.first * by_length,
            );
            for (k, (other, by)) in state.joints.iter().flatten().enumerate().take(i + 1) {
                let mu_other = scale * multipliers[torque + torque_row(*other)];
                let by_first = by.length_first * inverse_slack;
                let mut value = w * fse.second * strain_first * by_first
                    + fse.first * (mu * joint.arm_first * by_first + mu_other * by.arm_first * strain_first);
                if k == i {
                    value += w * fse.first * joint.length_second * inverse_slack + mu * joint.arm_second * fse.value;
                }
                out.hessian(p + Q + coordinate, p + Q + other, value);
            }
        }
    }
}
