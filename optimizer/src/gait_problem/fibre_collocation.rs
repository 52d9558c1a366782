//! Rows of C8: Hermite-Simpson integration of fibre velocities to fibre lengths, in optimal fibre lengths.

use super::hermite_simpson::{self, SLOPE, STATE};
use super::program_data::{DomainContext, GaitProgram};
use super::rows::DomainRows;
use super::sparse_entries::Entries;
use crate::muscle::MUSCLE_COUNT;

/// Values.
pub(super) fn values(program: &GaitProgram, context: &DomainContext<'_>, rows: &DomainRows, x: &[f64], g: &mut [f64]) {
    let Some(first) = rows.fibres else { return };
    let layout = context.layout;
    let h = context.duration / layout.intervals as f64;
    for interval in 0..layout.intervals {
        for m in 0..MUSCLE_COUNT {
            let at_nodes = |first: usize| {
                std::array::from_fn(|i| program.layout.value(x, layout.point(2 * interval + i) + first + m))
            };
            let rows = hermite_simpson::values(h, at_nodes(layout.fibre_length()), at_nodes(layout.fibre_velocity()));
            for (kind, value) in rows.into_iter().enumerate() {
                g[first + 2 * MUSCLE_COUNT * interval + MUSCLE_COUNT * kind + m] = value;
            }
        }
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
    let Some(first) = rows.fibres else { return };
    let layout = context.layout;
    let n = layout.intervals as f64;
    let h = context.duration / n;
    for interval in 0..layout.intervals {
        for m in 0..MUSCLE_COUNT {
            for kind in 0..2 {
                let row = first + 2 * MUSCLE_COUNT * interval + MUSCLE_COUNT * kind + m;
                let mut by_duration = 0.0;
                for i in 0..3 {
                    let p = layout.point(2 * interval + i);
                    let velocity = p + layout.fibre_velocity() + m;
                    if STATE[kind][i] != 0.0 {
                        out.jacobian(row, p + layout.fibre_length() + m, STATE[kind][i]);
                    }
                    if SLOPE[kind][i] != 0.0 {
                        out.jacobian(row, velocity, h * SLOPE[kind][i]);
                        by_duration += SLOPE[kind][i] / n * program.layout.value(x, velocity);
                    }
                }
                out.jacobian(row, layout.duration, by_duration);
            }
        }
    }
}

/// Hessian.
pub(super) fn hessian(context: &DomainContext<'_>, rows: &DomainRows, multipliers: &[f64], out: &mut Entries<'_>) {
    let Some(first) = rows.fibres else { return };
    let layout = context.layout;
    let n = layout.intervals as f64;
    for interval in 0..layout.intervals {
        for m in 0..MUSCLE_COUNT {
            let row = first + 2 * MUSCLE_COUNT * interval + m;
            for i in 0..3 {
                let velocity = layout.point(2 * interval + i) + layout.fibre_velocity() + m;
                let weight = multipliers[row] * SLOPE[0][i] + multipliers[row + MUSCLE_COUNT] * SLOPE[1][i];
                out.hessian(velocity, layout.duration, weight / n);
            }
        }
    }
}
