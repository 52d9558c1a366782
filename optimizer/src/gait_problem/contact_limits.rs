//! Rows of C3: friction cones, touchdown speed, and forward hip velocity in SS1. [`super::foot_clearance`] has the heights
//! of the feet.

use super::foot_clearance::{self, side_of};
use super::layout::{FORCE, PointVariables, Q, QD};
use super::motion_and_contact_rows::{add_contact_hessian, leg_angles, position_gradient, velocity_angle_gradient};
use super::program_data::{GaitProgram, PointContext};
use super::rows::PointRows;
use super::sparse_entries::Entries;
use crate::body::dynamics::LinkHessian;
use crate::body::{Axis, PointState, Side};

/// Scale of a friction row, 1/N.
pub(super) const FRICTION_SCALE: f64 = 1.0 / 500.0;

/// The feet on the ground with their numbers, stance foot first.
fn feet(context: &PointContext<'_>) -> impl Iterator<Item = (usize, Side)> {
    let stance = context.layout.domain.stance;
    let on_the_ground = |side: &Side| context.contacts.iter().any(|row| row.side == *side);
    [stance, stance.other()].into_iter().filter(on_the_ground).enumerate()
}

/// The forces of a foot: axis and index.
fn forces_of(context: &PointContext<'_>, side: Side) -> impl Iterator<Item = (bool, usize)> {
    let rows = context.contacts.iter().enumerate().filter(move |(_, row)| row.side == side);
    rows.map(|(c, row)| (row.axis == Axis::X, c))
}

/// Values.
pub(super) fn values(
    program: &GaitProgram,
    context: &PointContext<'_>,
    rows: &PointRows,
    point: &PointVariables,
    state: &PointState,
    x: &[f64],
    g: &mut [f64],
) {
    for (foot, side) in feet(context) {
        let (mut tangential, mut normal) = (0.0, 0.0);
        for (is_x, c) in forces_of(context, side) {
            if is_x {
                tangential += point.force[c];
            } else {
                normal += point.force[c];
            }
        }
        let row = rows.friction + 2 * foot;
        g[row] = FRICTION_SCALE * (program.limits.friction * normal - tangential);
        g[row + 1] = FRICTION_SCALE * (program.limits.friction * normal + tangential);
    }
    foot_clearance::values(program, context, rows, state, x, g);
    if let Some(row) = rows.phase_rate {
        g[row] = context.hip_phase(point)[1];
    }
    if let Some((foot_point, row)) = rows.touchdown {
        g[row] = state.contact_velocity(&program.foot_points[foot_point])[1];
    }
}

/// Jacobian.
pub(super) fn jacobian(
    program: &GaitProgram,
    context: &PointContext<'_>,
    rows: &PointRows,
    state: &PointState,
    x: &[f64],
    p: usize,
    out: &mut Entries<'_>,
) {
    for (foot, side) in feet(context) {
        let row = rows.friction + 2 * foot;
        for (is_x, c) in forces_of(context, side) {
            let variable = p + FORCE + c;
            if is_x {
                out.jacobian(row, variable, -FRICTION_SCALE);
                out.jacobian(row + 1, variable, FRICTION_SCALE);
            } else {
                out.jacobian(row, variable, FRICTION_SCALE * program.limits.friction);
                out.jacobian(row + 1, variable, FRICTION_SCALE * program.limits.friction);
            }
        }
    }
    foot_clearance::jacobian(program, context, rows, state, x, p, out);
    if let Some(row) = rows.phase_rate {
        for (angle, coefficient) in context.phase_terms() {
            out.jacobian(row, p + QD + angle, coefficient);
        }
    }
    if let Some((foot_point, row)) = rows.touchdown {
        let foot = &program.foot_points[foot_point];
        let by_rate = position_gradient(state, foot, Axis::Z);
        let by_angle = velocity_angle_gradient(state, foot, Axis::Z);
        out.jacobian(row, p + QD + 1, 1.0);
        for i in leg_angles(side_of(foot_point)) {
            out.jacobian(row, p + Q + 2 + i, by_angle[i]);
            out.jacobian(row, p + QD + 2 + i, by_rate[i]);
        }
    }
}

/// Hessian: adds the part in link space to `link`, and writes the part of the durations.
#[allow(clippy::too_many_arguments)] // point, posture, multipliers and the two sinks are different things
pub(super) fn hessian(
    program: &GaitProgram,
    context: &PointContext<'_>,
    rows: &PointRows,
    state: &PointState,
    x: &[f64],
    multipliers: &[f64],
    link: &mut LinkHessian,
    out: &mut Entries<'_>,
) {
    foot_clearance::hessian(program, context, rows, state, x, multipliers, link, out);
    if let Some((foot_point, row)) = rows.touchdown {
        let foot = &program.foot_points[foot_point];
        add_contact_hessian(state, foot, [0.0; 2], [0.0, multipliers[row]], [0.0; 2], link);
    }
}
