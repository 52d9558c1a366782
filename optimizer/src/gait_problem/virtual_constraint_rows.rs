//! Rows of C2: the virtual constraints, outputs of relative degree 2.
//!
//! The rows are `e0 = q_o - y(s)`, `e1 = qd_o - y'(s) sd` and `e2 = qdd_o - y''(s) sd^2 - y'(s) sdd` (divided by 10),
//! with the Bezier curve y of the domain. In the fully actuated domains s = sigma_k, sd = 1/T and sdd = 0 exactly. In
//! SS1 `s = (dp - pa)/(pb - pa)` depends on the state.

use super::layout::{DomainLayout, MAX_OUTPUTS, PointVariables, Q, QD, QDD};
use super::program_data::{GaitProgram, PointContext};
use super::rows::PointRows;
use super::sparse_entries::Entries;
use crate::walking::{BEZIER_COEFFICIENTS, basis};

const SECOND_SCALE: f64 = 0.1;

/// The phase s at a node, with its first two time derivatives.
#[derive(Debug, Clone, Copy)]
struct Phase {
    s: f64,
    rate: f64,
    acceleration: f64,
}

/// Bezier coefficients of a domain, rad.
fn coefficients(program: &GaitProgram, layout: &DomainLayout, x: &[f64]) -> [[f64; BEZIER_COEFFICIENTS]; MAX_OUTPUTS] {
    let mut alpha = [[0.0; BEZIER_COEFFICIENTS]; MAX_OUTPUTS];
    for j in 0..layout.outputs.len() {
        for i in 0..BEZIER_COEFFICIENTS {
            alpha[j][i] = program.layout.value(x, layout.bezier_coefficient(j, i));
        }
    }
    alpha
}

fn dot(a: &[f64; BEZIER_COEFFICIENTS], b: &[f64; BEZIER_COEFFICIENTS]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Width `pb - pa` of the phase and the phase itself.
fn phase_of(program: &GaitProgram, context: &PointContext<'_>, point: &PointVariables, x: &[f64]) -> (Phase, f64) {
    let layout = context.layout;
    match layout.phase_end {
        None => {
            let rate = 1.0 / context.duration;
            (Phase { s: layout.sigma(context.k), rate, acceleration: 0.0 }, 1.0)
        }
        Some(end) => {
            let start = program.layout.value(x, layout.phase_start);
            let width = program.layout.value(x, end) - start;
            let [dp, dpd, dpdd] = context.hip_phase(point);
            (Phase { s: (dp - start) / width, rate: dpd / width, acceleration: dpdd / width }, width)
        }
    }
}

/// Values.
pub(super) fn values(
    program: &GaitProgram,
    context: &PointContext<'_>,
    rows: &PointRows,
    point: &PointVariables,
    x: &[f64],
    g: &mut [f64],
) {
    let layout = context.layout;
    let (phase, _) = phase_of(program, context, point, x);
    let b = basis(phase.s);
    let alpha = coefficients(program, layout, x);
    for (j, &output) in layout.outputs.iter().enumerate() {
        let (y0, y1, y2) = (dot(&alpha[j], &b[0]), dot(&alpha[j], &b[1]), dot(&alpha[j], &b[2]));
        g[rows.output_position + j] = point.q[output] - y0;
        g[rows.output_velocity + j] = point.qd[output] - y1 * phase.rate;
        g[rows.output_acceleration + j] =
            SECOND_SCALE * (point.qdd[output] - y2 * phase.rate * phase.rate - y1 * phase.acceleration);
    }
}

/// Jacobian.
pub(super) fn jacobian(
    program: &GaitProgram,
    context: &PointContext<'_>,
    rows: &PointRows,
    point: &PointVariables,
    x: &[f64],
    p: usize,
    out: &mut Entries<'_>,
) {
    let layout = context.layout;
    let (phase, width) = phase_of(program, context, point, x);
    let b = basis(phase.s);
    let alpha = coefficients(program, layout, x);
    for (j, &output) in layout.outputs.iter().enumerate() {
        let y: [f64; 4] = std::array::from_fn(|r| dot(&alpha[j], &b[r]));
        let (row0, row1, row2) = (rows.output_position + j, rows.output_velocity + j, rows.output_acceleration + j);
        out.jacobian(row0, p + Q + output, 1.0);
        out.jacobian(row1, p + QD + output, 1.0);
        out.jacobian(row2, p + QDD + output, SECOND_SCALE);
        for i in 0..BEZIER_COEFFICIENTS {
            let variable = layout.bezier_coefficient(j, i);
            out.jacobian(row0, variable, -b[0][i]);
            out.jacobian(row1, variable, -b[1][i] * phase.rate);
            out.jacobian(
                row2,
                variable,
                -SECOND_SCALE * (b[2][i] * phase.rate * phase.rate + b[1][i] * phase.acceleration),
            );
        }
        match layout.phase_end {
            None => {
                // rate = 1/T
                let rate_by_duration = -phase.rate * phase.rate;
                out.jacobian(row1, layout.duration, -y[1] * rate_by_duration);
                out.jacobian(row2, layout.duration, -SECOND_SCALE * 2.0 * y[2] * phase.rate * rate_by_duration);
            }
            Some(end) => {
                // Derivatives with respect to (s, v, a), then to (dp, pa, pb), (dpd, ...), (dpdd, ...).
                let (v, a) = (phase.rate, phase.acceleration);
                let by_s = [-y[1], -y[2] * v, -SECOND_SCALE * (y[3] * v * v + y[2] * a)];
                let by_v = [0.0, -y[1], -SECOND_SCALE * 2.0 * y[2] * v];
                let by_a = [0.0, 0.0, -SECOND_SCALE * y[1]];
                let inverse = 1.0 / width;
                for (r, row) in [row0, row1, row2].into_iter().enumerate() {
                    let by_start = (by_s[r] * (phase.s - 1.0) + by_v[r] * v + by_a[r] * a) * inverse;
                    let by_end = -(by_s[r] * phase.s + by_v[r] * v + by_a[r] * a) * inverse;
                    out.jacobian(row, layout.phase_start, by_start);
                    out.jacobian(row, end, by_end);
                    for (angle, coefficient) in context.phase_terms() {
                        out.jacobian(row, p + Q + angle, by_s[r] * inverse * coefficient);
                        if r >= 1 {
                            out.jacobian(row, p + QD + angle, by_v[r] * inverse * coefficient);
                        }
                        if r >= 2 {
                            out.jacobian(row, p + QDD + angle, by_a[r] * inverse * coefficient);
                        }
                    }
                }
            }
        }
    }
}

/// Hessian.
#[allow(clippy::too_many_arguments)] // point, posture, multipliers and the two sinks are different things
pub(super) fn hessian(
    program: &GaitProgram,
    context: &PointContext<'_>,
    rows: &PointRows,
    point: &PointVariables,
    x: &[f64],
    p: usize,
    multipliers: &[f64],
    out: &mut Entries<'_>,
) {
    let layout = context.layout;
    let (phase, width) = phase_of(program, context, point, x);
    let b = basis(phase.s);
    let alpha = coefficients(program, layout, x);
    let (v, a) = (phase.rate, phase.acceleration);
    let Some(end) = layout.phase_end else {
        let rate = v;
        let rate1 = -rate * rate;
        let rate2 = 2.0 * rate * rate * rate;
        let mut duration_duration = 0.0;
        for j in 0..layout.outputs.len() {
            let m1 = multipliers[rows.output_velocity + j];
            let m2 = SECOND_SCALE * multipliers[rows.output_acceleration + j];
            let (y1, y2) = (dot(&alpha[j], &b[1]), dot(&alpha[j], &b[2]));
            // d2(rate)/dT2 = 2/T^3; d2(rate^2)/dT2 = 6/T^4
            duration_duration -= m1 * y1 * rate2 + m2 * y2 * 6.0 * rate1 * rate1;
            for i in 0..BEZIER_COEFFICIENTS {
                let cross = -(m1 * b[1][i] * rate1 + m2 * b[2][i] * 2.0 * rate * rate1);
                out.hessian(layout.bezier_coefficient(j, i), layout.duration, cross);
            }
        }
        out.hessian(layout.duration, layout.duration, duration_duration);
        return;
    };
    // L(s, v, a, alpha) = -sum_j m0 y + m1 y' v + m2 (y'' v^2 + y' a)
    let (mut l_s, mut l_v, mut l_a) = (0.0, 0.0, 0.0);
    let (mut l_ss, mut l_sv, mut l_sa, mut l_vv) = (0.0, 0.0, 0.0, 0.0);
    let inverse = 1.0 / width;
    // d(s, v, a)/d(dp, dpd, dpdd, pa, pb)
    let s = phase.s;
    let ds = [inverse, 0.0, 0.0, (s - 1.0) * inverse, -s * inverse];
    let dv = [0.0, inverse, 0.0, v * inverse, -v * inverse];
    let da = [0.0, 0.0, inverse, a * inverse, -a * inverse];
    for j in 0..layout.outputs.len() {
        let m0 = multipliers[rows.output_position + j];
        let m1 = multipliers[rows.output_velocity + j];
        let m2 = SECOND_SCALE * multipliers[rows.output_acceleration + j];
        let y: [f64; 5] = std::array::from_fn(|r| dot(&alpha[j], &b[r]));
        l_s -= m0 * y[1] + m1 * y[2] * v + m2 * (y[3] * v * v + y[2] * a);
        l_v -= m1 * y[1] + 2.0 * m2 * y[2] * v;
        l_a -= m2 * y[1];
        l_ss -= m0 * y[2] + m1 * y[3] * v + m2 * (y[4] * v * v + y[3] * a);
        l_sv -= m1 * y[2] + 2.0 * m2 * y[3] * v;
        l_sa -= m2 * y[2];
        l_vv -= 2.0 * m2 * y[2];
        for i in 0..BEZIER_COEFFICIENTS {
            let by_s = -(m0 * b[1][i] + m1 * b[2][i] * v + m2 * (b[3][i] * v * v + b[2][i] * a));
            let by_v = -(m1 * b[1][i] + 2.0 * m2 * b[2][i] * v);
            let by_a = -m2 * b[1][i];
            let variable = layout.bezier_coefficient(j, i);
            out.hessian(variable, layout.phase_start, by_s * ds[3] + by_v * dv[3] + by_a * da[3]);
            out.hessian(variable, end, by_s * ds[4] + by_v * dv[4] + by_a * da[4]);
            for (angle, coefficient) in context.phase_terms() {
                out.hessian(variable, p + Q + angle, by_s * inverse * coefficient);
                out.hessian(variable, p + QD + angle, by_v * inverse * coefficient);
                out.hessian(variable, p + QDD + angle, by_a * inverse * coefficient);
            }
        }
    }
    // Outer Hessian over (dp, dpd, dpdd, pa, pb).
    let mut h = [[0.0; 5]; 5];
    for r in 0..5 {
        for c in 0..5 {
            h[r][c] = l_ss * ds[r] * ds[c]
                + l_sv * (ds[r] * dv[c] + dv[r] * ds[c])
                + l_sa * (ds[r] * da[c] + da[r] * ds[c])
                + l_vv * dv[r] * dv[c];
        }
    }
    // Second derivatives of s, v and a; each has the form (z - pa')/width.
    let i2 = inverse * inverse;
    let mut both = |r: usize, c: usize, value: f64| {
        h[r][c] += value;
        if r != c {
            h[c][r] += value;
        }
    };
    for (k, l) in [(0, l_s), (1, l_v), (2, l_a)] {
        both(k, 3, l * i2);
        both(k, 4, -l * i2);
    }
    both(3, 3, 2.0 * i2 * (l_s * (s - 1.0) + l_v * v + l_a * a));
    both(3, 4, i2 * (l_s * (1.0 - 2.0 * s) - 2.0 * l_v * v - 2.0 * l_a * a));
    both(4, 4, 2.0 * i2 * (l_s * s + l_v * v + l_a * a));
    out.hessian(layout.phase_start, layout.phase_start, h[3][3]);
    out.hessian(end, layout.phase_start, h[4][3]);
    out.hessian(end, end, h[4][4]);
    let offsets = [Q, QD, QDD];
    for (r, &offset_r) in offsets.iter().enumerate() {
        for (ia, (angle_a, ca)) in context.phase_terms().enumerate() {
            let variable = p + offset_r + angle_a;
            out.hessian(variable, layout.phase_start, h[r][3] * ca);
            out.hessian(variable, end, h[r][4] * ca);
            for (c, &offset_c) in offsets.iter().enumerate().take(r + 1) {
                for (ib, (angle_b, cb)) in context.phase_terms().enumerate() {
                    if c == r && ib > ia {
                        continue;
                    }
                    out.hessian(variable, p + offset_c + angle_b, h[r][c] * ca * cb);
                }
            }
        }
    }
}
