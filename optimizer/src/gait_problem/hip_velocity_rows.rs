//! Rows of C2: the hip velocity, an output of relative degree 1, and the phase that it drives.
//!
//! In the fully actuated domains `dp = pa + v_hip T sigma_k`, `dp_dot = v_hip` and `dp_ddot = 0` (divided by 10). At
//! the first node of every domain `dp = pa`.

use super::layout::{PointVariables, Q, QD, QDD};
use super::program_data::{GaitProgram, PointContext};
use super::rows::PointRows;
use super::sparse_entries::Entries;

const ACCELERATION_SCALE: f64 = 0.1;

/// Values.
pub(super) fn values(
    program: &GaitProgram,
    context: &PointContext<'_>,
    rows: &PointRows,
    point: &PointVariables,
    x: &[f64],
    g: &mut [f64],
) {
    let [dp, dpd, dpdd] = context.hip_phase(point);
    if let Some(row) = rows.hip_phase {
        let travelled = context.hip_velocity * context.duration * context.layout.sigma(context.k);
        g[row] = dp - program.layout.value(x, context.layout.phase_start) - travelled;
    }
    if let Some(row) = rows.hip_velocity {
        g[row] = dpd - context.hip_velocity;
    }
    if let Some(row) = rows.hip_acceleration {
        g[row] = ACCELERATION_SCALE * dpdd;
    }
}

/// Jacobian.
pub(super) fn jacobian(context: &PointContext<'_>, rows: &PointRows, p: usize, out: &mut Entries<'_>) {
    let layout = context.layout;
    let sigma = layout.sigma(context.k);
    if let Some(row) = rows.hip_phase {
        for (angle, coefficient) in context.phase_terms() {
            out.jacobian(row, p + Q + angle, coefficient);
        }
        out.jacobian(row, layout.phase_start, -1.0);
        if let (Some(hip_velocity), true) = (layout.hip_velocity, context.k > 0) {
            out.jacobian(row, hip_velocity, -context.duration * sigma);
            out.jacobian(row, layout.duration, -context.hip_velocity * sigma);
        }
    }
    if let (Some(row), Some(hip_velocity)) = (rows.hip_velocity, layout.hip_velocity) {
        for (angle, coefficient) in context.phase_terms() {
            out.jacobian(row, p + QD + angle, coefficient);
        }
        out.jacobian(row, hip_velocity, -1.0);
    }
    if let Some(row) = rows.hip_acceleration {
        for (angle, coefficient) in context.phase_terms() {
            out.jacobian(row, p + QDD + angle, ACCELERATION_SCALE * coefficient);
        }
    }
}

/// Hessian.
pub(super) fn hessian(context: &PointContext<'_>, rows: &PointRows, multipliers: &[f64], out: &mut Entries<'_>) {
    let layout = context.layout;
    if let (Some(row), Some(hip_velocity), true) = (rows.hip_phase, layout.hip_velocity, context.k > 0) {
        out.hessian(layout.duration, hip_velocity, -multipliers[row] * layout.sigma(context.k));
    }
}
