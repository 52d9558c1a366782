//! Rows of C3: heights of heel and toe, on or above the ground, and above the clearance in the swing phase (a5).

use super::layout::Q;
use super::motion_and_contact_rows::{add_contact_hessian, leg_angles, position_gradient};
use super::program_data::{GaitProgram, PointContext};
use super::rows::{HeightRow, PointRows};
use super::sparse_entries::Entries;
use crate::body::dynamics::LinkHessian;
use crate::body::{Axis, PointState, Side};
use crate::walking::{DomainKind, clearance_profile};

/// Scale of a height row, 1/m.
pub(super) const HEIGHT_SCALE: f64 = 10.0;

/// Side of a foot point in the order heel_L, toe_L, heel_R, toe_R.
pub(super) fn side_of(foot_point: usize) -> Side {
    if foot_point < 2 { Side::Left } else { Side::Right }
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
    state: &PointState,
    x: &[f64],
    g: &mut [f64],
) {
    for height in &rows.heights {
        g[height.row] = height_row(program, context.d, context.layout.sigma(context.k), state, *height, x);
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
}
