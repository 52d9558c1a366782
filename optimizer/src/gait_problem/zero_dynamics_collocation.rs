//! Rows of C1 in SS1: Hermite-Simpson integration of the underactuated degree of freedom.
//!
//! In each interval of length h = T/N with nodes 0, m and 1, `z_m = (z_0 + z_1)/2 + h/8 (f_0 - f_1)` and `z_1 = z_0 +
//! h/6 (f_0 + 4 f_m + f_1)` for (z, f) = (dp, dp_dot) and (dp_dot, dp_ddot). The phase limit pb is dp at the last node.

use super::hermite_simpson::{self, SLOPE, STATE};
use super::layout::{Q, QD, QDD};
use super::program_data::{DomainContext, GaitProgram};
use super::rows::DomainRows;
use super::sparse_entries::Entries;

/// Values.
pub(super) fn values(program: &GaitProgram, context: &DomainContext<'_>, rows: &DomainRows, x: &[f64], g: &mut [f64]) {
    let layout = context.layout;
    if let Some(first) = rows.zero_dynamics {
        let h = context.duration / layout.intervals as f64;
        for interval in 0..layout.intervals {
            let z: [[f64; 3]; 3] = std::array::from_fn(|i| {
                let point = program.layout.point_variables(x, context.d, 2 * interval + i);
                context.phase.derivatives(&point)
            });
            for order in 0..2 {
                let row = first + 4 * interval + 2 * order;
                let rows = hermite_simpson::values(h, z.map(|z| z[order]), z.map(|z| z[order + 1]));
                g[row..row + 2].copy_from_slice(&rows);
            }
        }
    }
    if let (Some(row), Some(end)) = (rows.phase_end, layout.phase_end) {
        let point = program.layout.point_variables(x, context.d, layout.last());
        g[row] = context.phase.derivatives(&point)[0] - program.layout.value(x, end);
    }
}

/// Jacobian.
pub(super) fn jacobian(
    program: &GaitProgram,
    context: &DomainContext<'_>,
    rows: &DomainRows,
    x: &[f64],
    out: &mut Entries<'_>,
) {
    let layout = context.layout;
    if let Some(first) = rows.zero_dynamics {
        let n = layout.intervals as f64;
        let h = context.duration / n;
        for interval in 0..layout.intervals {
            let z: [[f64; 3]; 3] = std::array::from_fn(|i| {
                let point = program.layout.point_variables(x, context.d, 2 * interval + i);
                context.phase.derivatives(&point)
            });
            for order in 0..2 {
                let (state_offset, slope_offset) = if order == 0 { (Q, QD) } else { (QD, QDD) };
                for kind in 0..2 {
                    let row = first + 4 * interval + 2 * order + kind;
                    let mut by_duration = 0.0;
                    for i in 0..3 {
                        let p = layout.point(2 * interval + i);
                        by_duration += SLOPE[kind][i] * z[i][order + 1] / n;
                        for (angle, coefficient) in context.phase.terms() {
                            if STATE[kind][i] != 0.0 {
                                out.jacobian(row, p + state_offset + angle, STATE[kind][i] * coefficient);
                            }
                            if SLOPE[kind][i] != 0.0 {
                                out.jacobian(row, p + slope_offset + angle, h * SLOPE[kind][i] * coefficient);
                            }
                        }
                    }
                    out.jacobian(row, layout.duration, by_duration);
                }
            }
        }
    }
    if let (Some(row), Some(end)) = (rows.phase_end, layout.phase_end) {
        let p = layout.point(layout.last());
        for (angle, coefficient) in context.phase.terms() {
            out.jacobian(row, p + Q + angle, coefficient);
        }
        out.jacobian(row, end, -1.0);
    }
}

/// Hessian.
pub(super) fn hessian(context: &DomainContext<'_>, rows: &DomainRows, multipliers: &[f64], out: &mut Entries<'_>) {
    let layout = context.layout;
    let Some(first) = rows.zero_dynamics else { return };
    let n = layout.intervals as f64;
    for interval in 0..layout.intervals {
        for order in 0..2 {
            let slope_offset = if order == 0 { QD } else { QDD };
            let row = first + 4 * interval + 2 * order;
            for i in 0..3 {
                let p = layout.point(2 * interval + i);
                let weight = (multipliers[row] * SLOPE[0][i] + multipliers[row + 1] * SLOPE[1][i]) / n;
                for (angle, coefficient) in context.phase.terms() {
                    out.hessian(p + slope_offset + angle, layout.duration, weight * coefficient);
                }
            }
        }
    }
}
