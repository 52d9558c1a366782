//! Rows of C2: resets from the last node of a domain to the first node of the next one, periodic over the stride.
//!
//! Positions are continuous, with px reduced by D after the last domain. Before DS2 and DS3 a plastic impact satisfies
//! `M(q) (qd+ - qd-) = J^T Lambda` with the contact rows of the new domain (divided by 5). Otherwise velocities are
//! continuous (divided by 3). Fibre lengths are continuous. The impulse of the landing heel is in its friction cone.

use super::layout::{PointVariables, Q, QD};
use super::motion_and_contact_rows::{axis_index, coupled, leg_angles, position_gradient, subtract_force};
use super::program_data::GaitProgram;
use super::rows::DomainRows;
use super::sparse_entries::Entries;
use crate::body::coordinates::{LINKS, congruence, link_angles, transform_rows};
use crate::body::dynamics::LinkHessian;
use crate::body::point::angles_of;
use crate::body::{InverseDynamics, PointState};
use crate::muscle::MUSCLE_COUNT;
use crate::walking::{CYCLE, ContactRow};

const IMPACT_SCALE: f64 = 1.0 / 5.0;
const VELOCITY_SCALE: f64 = 1.0 / 3.0;
const IMPULSE_SCALE: f64 = 1.0 / 20.0;

/// The two sides of a transition.
struct Transition {
    next: usize,
    before: PointVariables,
    after: PointVariables,
    first_before: usize,
    first_after: usize,
    impulse: Option<usize>,
}

fn transition(program: &GaitProgram, x: &[f64], d: usize) -> Transition {
    let next = (d + 1) % CYCLE.len();
    let layout = &program.layout.domains[d];
    Transition {
        next,
        before: program.layout.point_variables(x, d, layout.last()),
        after: program.layout.point_variables(x, next, 0),
        first_before: layout.point(layout.last()),
        first_after: program.layout.domains[next].point(0),
        impulse: program.layout.domains[next].impulse,
    }
}

/// Posture and velocity jump of an impact, as a state whose accelerations are the jump.
fn jump(t: &Transition) -> PointState {
    let mut dv = [0.0; 9];
    for i in 0..9 {
        dv[i] = t.after.qd[i] - t.before.qd[i];
    }
    PointState::new(&t.after.q, &[0.0; 9], &dv)
}

fn contact_rows(program: &GaitProgram, next: usize) -> &[ContactRow] {
    &program.contacts[next]
}

/// Values.
pub(super) fn values(program: &GaitProgram, d: usize, rows: &DomainRows, x: &[f64], g: &mut [f64]) {
    let t = transition(program, x, d);
    for i in 0..9 {
        let mut value = t.after.q[i] - t.before.q[i];
        if i == 0 && t.next == 0 {
            value += program.layout.value(x, program.layout.stride_length);
        }
        g[rows.position_reset + i] = value;
    }
    if let Some(impulse) = t.impulse {
        let state = jump(&t);
        let mut momentum = InverseDynamics::without_gravity(&program.model).rows(&state);
        for (c, row) in contact_rows(program, t.next).iter().enumerate() {
            subtract_force(program, &state, *row, program.layout.value(x, impulse + c), &mut momentum);
        }
        for i in 0..9 {
            g[rows.velocity_reset + i] = momentum[i] * IMPACT_SCALE;
        }
        if let Some(row) = rows.impact_friction {
            let tangential = program.layout.value(x, impulse);
            let normal = program.limits.impact_friction * program.layout.value(x, impulse + 1);
            g[row] = IMPULSE_SCALE * (normal - tangential);
            g[row + 1] = IMPULSE_SCALE * (normal + tangential);
        }
    } else {
        for i in 0..9 {
            g[rows.velocity_reset + i] = (t.after.qd[i] - t.before.qd[i]) * VELOCITY_SCALE;
        }
    }
    if let Some(row) = rows.fibre_reset {
        for m in 0..MUSCLE_COUNT {
            g[row + m] = t.after.fibre_length[m] - t.before.fibre_length[m];
        }
    }
}

/// Jacobian.
pub(super) fn jacobian(program: &GaitProgram, d: usize, rows: &DomainRows, x: &[f64], out: &mut Entries<'_>) {
    let t = transition(program, x, d);
    for i in 0..9 {
        out.jacobian(rows.position_reset + i, t.first_after + Q + i, 1.0);
        out.jacobian(rows.position_reset + i, t.first_before + Q + i, -1.0);
    }
    if t.next == 0 {
        out.jacobian(rows.position_reset, program.layout.stride_length, 1.0);
    }
    if let Some(impulse) = t.impulse {
        let state = jump(&t);
        let mut derivative = InverseDynamics::without_gravity(&program.model).jacobian(&state);
        let mut stiffness = [[0.0; LINKS]; LINKS];
        for (c, row) in contact_rows(program, t.next).iter().enumerate() {
            let foot = program.contact_point(*row);
            let value = program.layout.value(x, impulse + c);
            for (k, u) in foot.vectors.iter().enumerate() {
                let link = foot.first_link + k;
                stiffness[link][link] += state.rotated(link, u)[axis_index(row.axis)] * value;
            }
        }
        let stiffness = congruence(&stiffness);
        for i in 0..9 {
            let row = rows.velocity_reset + i;
            for j in 0..LINKS {
                if i >= 2 {
                    derivative.angle[i][j] += stiffness[i - 2][j];
                }
                if i < 2 || coupled(i - 2, j) {
                    out.jacobian(row, t.first_after + Q + 2 + j, derivative.angle[i][j] * IMPACT_SCALE);
                }
            }
            for j in 0..9 {
                let structural = if i < 2 { j >= 2 || i == j } else { j < 2 || coupled(i - 2, j - 2) };
                if structural {
                    out.jacobian(row, t.first_after + QD + j, derivative.mass[i][j] * IMPACT_SCALE);
                    out.jacobian(row, t.first_before + QD + j, -derivative.mass[i][j] * IMPACT_SCALE);
                }
            }
        }
        for (c, contact) in contact_rows(program, t.next).iter().enumerate() {
            let gradient = position_gradient(&state, program.contact_point(*contact), contact.axis);
            out.jacobian(rows.velocity_reset + axis_index(contact.axis), impulse + c, -IMPACT_SCALE);
            for i in leg_angles(contact.side) {
                out.jacobian(rows.velocity_reset + 2 + i, impulse + c, -gradient[i] * IMPACT_SCALE);
            }
        }
        if let Some(row) = rows.impact_friction {
            let friction = program.limits.impact_friction;
            out.jacobian(row, impulse, -IMPULSE_SCALE);
            out.jacobian(row, impulse + 1, IMPULSE_SCALE * friction);
            out.jacobian(row + 1, impulse, IMPULSE_SCALE);
            out.jacobian(row + 1, impulse + 1, IMPULSE_SCALE * friction);
        }
    } else {
        for i in 0..9 {
            out.jacobian(rows.velocity_reset + i, t.first_after + QD + i, VELOCITY_SCALE);
            out.jacobian(rows.velocity_reset + i, t.first_before + QD + i, -VELOCITY_SCALE);
        }
    }
    if let Some(row) = rows.fibre_reset {
        let after = t.first_after + program.layout.domains[t.next].fibre_length();
        let before = t.first_before + program.layout.domains[d].fibre_length();
        for m in 0..MUSCLE_COUNT {
            out.jacobian(row + m, after + m, 1.0);
            out.jacobian(row + m, before + m, -1.0);
        }
    }
}

/// Hessian.
pub(super) fn hessian(
    program: &GaitProgram,
    d: usize,
    rows: &DomainRows,
    x: &[f64],
    multipliers: &[f64],
    out: &mut Entries<'_>,
) {
    let t = transition(program, x, d);
    let Some(impulse) = t.impulse else { return };
    let state = jump(&t);
    let mut weights = [0.0; 9];
    for i in 0..9 {
        weights[i] = multipliers[rows.velocity_reset + i] * IMPACT_SCALE;
    }
    let mut link = LinkHessian::default();
    InverseDynamics::without_gravity(&program.model).add_hessian(&state, &weights, &mut link);
    let link_weights = link_angles(&angles_of(&weights));
    for (c, row) in contact_rows(program, t.next).iter().enumerate() {
        let foot = program.contact_point(*row);
        let axis = axis_index(row.axis);
        let value = program.layout.value(x, impulse + c);
        let mut cross = [[0.0; 1]; LINKS];
        for (k, u) in foot.vectors.iter().enumerate() {
            let j = foot.first_link + k;
            let a = state.rotated(j, u);
            let tangent = [-a[1], a[0]];
            link.angle_angle[j][j] += link_weights[j] * tangent[axis] * value;
            cross[j][0] = link_weights[j] * a[axis];
        }
        let cross = transform_rows(&cross);
        for i in leg_angles(row.side) {
            out.hessian(t.first_after + Q + 2 + i, impulse + c, cross[i][0]);
        }
    }
    let general = link.generalised();
    for i in 0..LINKS {
        let angle = t.first_after + Q + 2 + i;
        for j in 0..LINKS {
            if !coupled(i, j) {
                continue;
            }
            if j <= i {
                out.hessian(angle, t.first_after + Q + 2 + j, general.angle_angle[i][j]);
            }
            out.hessian(angle, t.first_after + QD + 2 + j, general.angle_acceleration[i][j]);
            out.hessian(angle, t.first_before + QD + 2 + j, -general.angle_acceleration[i][j]);
        }
        for axis in 0..2 {
            out.hessian(angle, t.first_after + QD + axis, general.angle_base[i][axis]);
            out.hessian(angle, t.first_before + QD + axis, -general.angle_base[i][axis]);
        }
    }
}
