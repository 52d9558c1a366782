//! Rows of C3: friction cones, foot heights, swing clearance, touchdown speed, and forward hip velocity in SS1.

use super::layout::{FORCE, PointVariables, Q, QD};
use super::mechanics::{add_contact_hessian, leg_angles, position_gradient, velocity_angle_gradient};
use super::program_data::{GaitProgram, PointContext};
use super::rows::{HeightRow, PointRows};
use super::sparse_entries::Entries;
use crate::body::dynamics::LinkHessian;
use crate::body::{Axis, PointState, Side};
use crate::walking::{DomainKind, clearance_profile};

/// Scale of a friction row, 1/N.
pub(super) const FRICTION_SCALE: f64 = 1.0 / 500.0;
/// Scale of a height row, 1/m.
pub(super) const HEIGHT_SCALE: f64 = 10.0;

/// Side of a foot point in the order heel_L, toe_L, heel_R, toe_R.
fn side_of(foot_point: usize) -> Side {
    if foot_point < 2 { Side::Left } else { Side::Right }
}

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

/// Fraction of the swing, `w = (alpha T_SS2 + beta T_SS1) / (T_SS2 + T_SS1)`, with the two duration variables.
struct SwingShare {
    w: f64,
    gradient: [f64; 2],
    hessian: [[f64; 2]; 2],
    durations: [usize; 2],
}

fn swing_share(program: &GaitProgram, d: usize, sigma: f64, x: &[f64]) -> SwingShare {
    let (ss2, ss1, alpha, beta) = match program.layout.domains[d].domain.kind {
        DomainKind::Ss2 => (d, d + 1, sigma, 0.0),
        _ => (d - 1, d, 1.0, sigma),
    };
    let durations = [program.layout.domains[ss2].duration, program.layout.domains[ss1].duration];
    let t2 = program.layout.value(x, durations[0]);
    let t1 = program.layout.value(x, durations[1]);
    let sum = t2 + t1;
    let w = (alpha * t2 + beta * t1) / sum;
    let gradient = [(alpha - w) / sum, (beta - w) / sum];
    let cross = -(gradient[0] + gradient[1]) / sum;
    let hessian = [[-2.0 * gradient[0] / sum, cross], [cross, -2.0 * gradient[1] / sum]];
    SwingShare { w, gradient, hessian, durations }
}

/// Value of a height row at a relative time of domain `d`, at a node or between nodes: the height minus the swing
/// clearance, if it applies.
pub(super) fn height_row(
    program: &GaitProgram,
    d: usize,
    sigma: f64,
    state: &PointState,
    height: HeightRow,
    x: &[f64],
) -> f64 {
    let z = state.contact_position(&program.foot_points[height.foot_point])[1];
    let mut value = HEIGHT_SCALE * z;
    if height.clearance {
        let share = swing_share(program, d, sigma, x);
        value -= HEIGHT_SCALE * program.limits.clearance_m * clearance_profile(share.w)[0];
    }
    value
}

/// How much a metre of swing clearance lowers the value of a height row.
pub(super) fn clearance_weight(program: &GaitProgram, d: usize, sigma: f64, x: &[f64]) -> f64 {
    HEIGHT_SCALE * clearance_profile(swing_share(program, d, sigma, x).w)[0]
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
    for height in &rows.heights {
        g[height.row] = height_row(program, context.d, context.layout.sigma(context.k), state, *height, x);
    }
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
    for height in &rows.heights {
        let foot = &program.foot_points[height.foot_point];
        let gradient = position_gradient(state, foot, Axis::Z);
        out.jacobian(height.row, p + Q + 1, HEIGHT_SCALE);
        for i in leg_angles(side_of(height.foot_point)) {
            out.jacobian(height.row, p + Q + 2 + i, HEIGHT_SCALE * gradient[i]);
        }
        if height.clearance {
            let share = swing_share(program, context.d, context.layout.sigma(context.k), x);
            let slope = -HEIGHT_SCALE * program.limits.clearance_m * clearance_profile(share.w)[1];
            for i in 0..2 {
                out.jacobian(height.row, share.durations[i], slope * share.gradient[i]);
            }
        }
    }
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
    for height in &rows.heights {
        let weight = HEIGHT_SCALE * multipliers[height.row];
        let foot = &program.foot_points[height.foot_point];
        add_contact_hessian(state, foot, [0.0, weight], [0.0; 2], [0.0; 2], link);
        if height.clearance {
            let share = swing_share(program, context.d, context.layout.sigma(context.k), x);
            let profile = clearance_profile(share.w);
            let scale = -weight * program.limits.clearance_m;
            for i in 0..2 {
                for j in 0..=i {
                    let value = profile[2] * share.gradient[i] * share.gradient[j] + profile[1] * share.hessian[i][j];
                    out.hessian(share.durations[i], share.durations[j], scale * value);
                }
            }
        }
    }
    if let Some((foot_point, row)) = rows.touchdown {
        let foot = &program.foot_points[foot_point];
        add_contact_hessian(state, foot, [0.0; 2], [0.0, multipliers[row]], [0.0; 2], link);
    }
}
