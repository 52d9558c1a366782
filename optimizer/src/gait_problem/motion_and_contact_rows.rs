//! Rows of C1 at a node: equations of motion and kinematics of the contact points.
//!
//! The rows are `M qdd + h = B u + J^T lambda` (divided by 100), `J qdd + Jdot qd = 0` (divided by 10), contact
//! positions and contact velocities. The Hessians of all rows of a node, including the heights of
//! [`super::contact_limits`], are summed in link space and transformed once.

use super::layout::{FORCE, PointVariables, Q, QD, QDD, U};
use super::program_data::{GaitProgram, PointContext};
use super::rows::PointRows;
use super::sparse_entries::Entries;
use crate::body::coordinates::{LINKS, link_angles, to_generalised, transform_rows};
use crate::body::dynamics::LinkHessian;
use crate::body::point::angles_of;
use crate::body::{Axis, ContactPoint, InverseDynamics, PointState, Side};
use crate::walking::ContactRow;

pub(super) const DYNAMICS_SCALE: f64 = 1.0 / 100.0;
pub(super) const ACCELERATION_SCALE: f64 = 1.0 / 10.0;

/// Indices of the angles that move the links of a leg: 0 torso, 1 to 3 left, 4 to 6 right.
#[inline]
pub(super) fn leg_angles(side: Side) -> [usize; 4] {
    match side {
        Side::Left => [0, 1, 2, 3],
        Side::Right => [0, 4, 5, 6],
    }
}

/// Whether two angles move a common link. The legs have only the torso in common.
#[inline]
pub(super) fn coupled(a: usize, b: usize) -> bool {
    a == 0 || b == 0 || (a < 4) == (b < 4)
}

#[inline]
pub(super) fn axis_index(axis: Axis) -> usize {
    match axis {
        Axis::X => 0,
        Axis::Z => 1,
    }
}

impl GaitProgram {
    /// Position component of a foot point, and its gradient with respect to the nine coordinates.
    pub fn foot_point_linearised(&self, state: &PointState, foot_point: usize, axis: Axis) -> (f64, [f64; 9]) {
        let point = &self.foot_points[foot_point];
        let index = axis_index(axis);
        let mut gradient = [0.0; 9];
        gradient[index] = 1.0;
        gradient[2..].copy_from_slice(&position_gradient(state, point, axis));
        (state.contact_position(point)[index], gradient)
    }
}

/// A 2-vector with `value` along `axis`.
#[inline]
fn along(axis: Axis, value: f64) -> [f64; 2] {
    match axis {
        Axis::X => [value, 0.0],
        Axis::Z => [0.0, value],
    }
}

/// d(position component)/d(angles) of a contact point.
#[inline]
pub(super) fn position_gradient(state: &PointState, point: &ContactPoint, axis: Axis) -> [f64; LINKS] {
    let mut per_link = [0.0; LINKS];
    for (k, u) in point.vectors.iter().enumerate() {
        let link = point.first_link + k;
        let a = state.rotated(link, u);
        per_link[link] = match axis {
            Axis::X => -a[1],
            Axis::Z => a[0],
        };
    }
    to_generalised(&per_link)
}

/// d(velocity component)/d(angles) of a contact point.
#[inline]
pub(super) fn velocity_angle_gradient(state: &PointState, point: &ContactPoint, axis: Axis) -> [f64; LINKS] {
    let mut per_link = [0.0; LINKS];
    for (k, u) in point.vectors.iter().enumerate() {
        let link = point.first_link + k;
        per_link[link] = -state.rate[link] * state.rotated(link, u)[axis_index(axis)];
    }
    to_generalised(&per_link)
}

/// Adds the second derivatives of `position . mp + velocity . mv + acceleration . ma` of a contact point.
#[inline]
pub(super) fn add_contact_hessian(
    state: &PointState,
    point: &ContactPoint,
    mp: [f64; 2],
    mv: [f64; 2],
    ma: [f64; 2],
    hessian: &mut LinkHessian,
) {
    for (k, u) in point.vectors.iter().enumerate() {
        let j = point.first_link + k;
        let a = state.rotated(j, u);
        let t = [-a[1], a[0]];
        let (rate, acceleration) = (state.rate[j], state.acceleration[j]);
        let dot = |m: [f64; 2], w: [f64; 2]| m[0] * w[0] + m[1] * w[1];
        hessian.angle_angle[j][j] +=
            -dot(mp, a) - rate * dot(mv, t) - acceleration * dot(ma, t) + rate * rate * dot(ma, a);
        hessian.angle_rate[j][j] += -dot(mv, a) - 2.0 * rate * dot(ma, t);
        hessian.rate_rate[j][j] -= 2.0 * dot(ma, a);
        hessian.angle_acceleration[j][j] -= dot(ma, a);
    }
}

/// Values of the rows of a node.
pub(super) fn values(
    program: &GaitProgram,
    context: &PointContext<'_>,
    rows: &PointRows,
    point: &PointVariables,
    state: &PointState,
    g: &mut [f64],
) {
    let mut motion = InverseDynamics::new(&program.model).rows(state);
    for (i, u) in point.u.iter().enumerate() {
        motion[3 + i] -= u;
    }
    for (c, row) in context.contacts.iter().enumerate() {
        subtract_force(program, state, *row, point.force[c], &mut motion);
    }
    for i in 0..9 {
        g[rows.dynamics + i] = motion[i] * DYNAMICS_SCALE;
    }
    for (c, row) in context.contacts.iter().enumerate() {
        let foot = program.contact_point(*row);
        let axis = axis_index(row.axis);
        g[rows.contact_acceleration + c] = state.contact_acceleration(foot)[axis] * ACCELERATION_SCALE;
        if let Some(first) = rows.contact_velocity {
            g[first + c] = state.contact_velocity(foot)[axis];
        }
    }
    for &(c, row) in &rows.contact_position {
        let contact = context.contacts[c];
        let position = state.contact_position(program.contact_point(contact))[axis_index(contact.axis)];
        let target = context.contact_targets[c];
        g[row] = position - target[0] - target[1] * context.right_step_length - target[2] * context.stride_length;
    }
}

/// `motion -= J_row^T force`.
#[inline]
pub(super) fn subtract_force(
    program: &GaitProgram,
    state: &PointState,
    row: ContactRow,
    force: f64,
    motion: &mut [f64; 9],
) {
    let gradient = position_gradient(state, program.contact_point(row), row.axis);
    motion[axis_index(row.axis)] -= force;
    for i in 0..LINKS {
        motion[2 + i] -= gradient[i] * force;
    }
}

/// Jacobian of the rows of a node; `p` is the first variable of the node.
pub(super) fn jacobian(
    program: &GaitProgram,
    context: &PointContext<'_>,
    rows: &PointRows,
    point: &PointVariables,
    state: &PointState,
    p: usize,
    out: &mut Entries<'_>,
) {
    let mut d = InverseDynamics::new(&program.model).jacobian(state);
    // d(-t . f)/dpsi = a . f in link space, transformed by A^T diag A.
    let mut link_stiffness = [0.0; LINKS];
    for (c, row) in context.contacts.iter().enumerate() {
        let foot = program.contact_point(*row);
        for (k, u) in foot.vectors.iter().enumerate() {
            let link = foot.first_link + k;
            link_stiffness[link] += state.rotated(link, u)[axis_index(row.axis)] * point.force[c];
        }
    }
    let mut stiffness = [[0.0; LINKS]; LINKS];
    for j in 0..LINKS {
        stiffness[j][j] = link_stiffness[j];
    }
    let stiffness = crate::body::coordinates::congruence(&stiffness);
    for i in 0..LINKS {
        for j in 0..LINKS {
            d.angle[2 + i][j] += stiffness[i][j];
        }
    }
    for i in 0..9 {
        let row = rows.dynamics + i;
        for j in 0..LINKS {
            if i < 2 || coupled(i - 2, j) {
                out.jacobian(row, p + Q + 2 + j, d.angle[i][j] * DYNAMICS_SCALE);
                out.jacobian(row, p + QD + 2 + j, d.rate[i][j] * DYNAMICS_SCALE);
                out.jacobian(row, p + QDD + 2 + j, d.mass[i][2 + j] * DYNAMICS_SCALE);
            }
        }
        for axis in 0..2 {
            if i >= 2 || i == axis {
                out.jacobian(row, p + QDD + axis, d.mass[i][axis] * DYNAMICS_SCALE);
            }
        }
        if i >= 3 {
            out.jacobian(row, p + U + i - 3, -DYNAMICS_SCALE);
        }
    }
    for (c, contact) in context.contacts.iter().enumerate() {
        let foot = program.contact_point(*contact);
        let axis = axis_index(contact.axis);
        let gradient = position_gradient(state, foot, contact.axis);
        let angles = leg_angles(contact.side);
        out.jacobian(rows.dynamics + axis, p + FORCE + c, -DYNAMICS_SCALE);
        for &i in &angles {
            out.jacobian(rows.dynamics + 2 + i, p + FORCE + c, -gradient[i] * DYNAMICS_SCALE);
        }
        // Acceleration rows.
        let mut by_angle = [0.0; LINKS];
        let mut by_rate = [0.0; LINKS];
        for (k, u) in foot.vectors.iter().enumerate() {
            let link = foot.first_link + k;
            let a = state.rotated(link, u);
            let t = [-a[1], a[0]];
            let rate = state.rate[link];
            by_angle[link] = -state.acceleration[link] * a[axis] - rate * rate * t[axis];
            by_rate[link] = -2.0 * rate * a[axis];
        }
        let by_angle = to_generalised(&by_angle);
        let by_rate = to_generalised(&by_rate);
        let row = rows.contact_acceleration + c;
        out.jacobian(row, p + QDD + axis, ACCELERATION_SCALE);
        for &i in &angles {
            out.jacobian(row, p + Q + 2 + i, by_angle[i] * ACCELERATION_SCALE);
            out.jacobian(row, p + QD + 2 + i, by_rate[i] * ACCELERATION_SCALE);
            out.jacobian(row, p + QDD + 2 + i, gradient[i] * ACCELERATION_SCALE);
        }
        if let Some(first) = rows.contact_velocity {
            let by_angle = velocity_angle_gradient(state, foot, contact.axis);
            out.jacobian(first + c, p + QD + axis, 1.0);
            for &i in &angles {
                out.jacobian(first + c, p + Q + 2 + i, by_angle[i]);
                out.jacobian(first + c, p + QD + 2 + i, gradient[i]);
            }
        }
    }
    for &(c, row) in &rows.contact_position {
        let contact = context.contacts[c];
        let gradient = position_gradient(state, program.contact_point(contact), contact.axis);
        out.jacobian(row, p + Q + axis_index(contact.axis), 1.0);
        for i in leg_angles(contact.side) {
            out.jacobian(row, p + Q + 2 + i, gradient[i]);
        }
        let target = context.contact_targets[c];
        if target[1] != 0.0 {
            out.jacobian(row, program.layout.right_step_length, -target[1]);
        }
        if target[2] != 0.0 {
            out.jacobian(row, program.layout.stride_length, -target[2]);
        }
    }
}

/// Adds the Hessian of the rows of a node in link space, and writes the columns of the forces.
#[allow(clippy::too_many_arguments)] // point, posture, multipliers and the two sinks are different things
pub(super) fn hessian(
    program: &GaitProgram,
    context: &PointContext<'_>,
    rows: &PointRows,
    point: &PointVariables,
    state: &PointState,
    p: usize,
    multipliers: &[f64],
    link: &mut LinkHessian,
    out: &mut Entries<'_>,
) {
    let mut motion = [0.0; 9];
    for i in 0..9 {
        motion[i] = multipliers[rows.dynamics + i] * DYNAMICS_SCALE;
    }
    InverseDynamics::new(&program.model).add_hessian(state, &motion, link);
    let weights = link_angles(&angles_of(&motion));
    for (c, contact) in context.contacts.iter().enumerate() {
        let foot = program.contact_point(*contact);
        let axis = axis_index(contact.axis);
        // The term -t . f has the second derivative +t . f and the mixed derivative +a with the force.
        let mut cross = [[0.0; 1]; LINKS];
        for (k, u) in foot.vectors.iter().enumerate() {
            let j = foot.first_link + k;
            let a = state.rotated(j, u);
            let t = [-a[1], a[0]];
            link.angle_angle[j][j] += weights[j] * t[axis] * point.force[c];
            cross[j][0] = weights[j] * a[axis];
        }
        let cross = transform_rows(&cross);
        for i in leg_angles(contact.side) {
            out.hessian(p + Q + 2 + i, p + FORCE + c, cross[i][0]);
        }
        let velocity = rows.contact_velocity.map_or(0.0, |first| multipliers[first + c]);
        let acceleration = multipliers[rows.contact_acceleration + c] * ACCELERATION_SCALE;
        add_contact_hessian(
            state,
            foot,
            [0.0; 2],
            along(contact.axis, velocity),
            along(contact.axis, acceleration),
            link,
        );
    }
    for &(c, row) in &rows.contact_position {
        let contact = context.contacts[c];
        let foot = program.contact_point(contact);
        add_contact_hessian(state, foot, along(contact.axis, multipliers[row]), [0.0; 2], [0.0; 2], link);
    }
}

/// Writes the Hessian of a node, summed in link space.
pub(super) fn write_link_hessian(link: &LinkHessian, p: usize, out: &mut Entries<'_>) {
    let general = link.generalised();
    for i in 0..LINKS {
        for j in 0..LINKS {
            if !coupled(i, j) {
                continue;
            }
            if j <= i {
                out.hessian(p + Q + 2 + i, p + Q + 2 + j, general.angle_angle[i][j]);
                out.hessian(p + QD + 2 + i, p + QD + 2 + j, general.rate_rate[i][j]);
            }
            out.hessian(p + Q + 2 + i, p + QD + 2 + j, general.angle_rate[i][j]);
            out.hessian(p + Q + 2 + i, p + QDD + 2 + j, general.angle_acceleration[i][j]);
        }
        for axis in 0..2 {
            out.hessian(p + Q + 2 + i, p + QDD + axis, general.angle_base[i][axis]);
        }
    }
}
