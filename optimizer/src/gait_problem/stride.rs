//! Rows of C4 over the whole stride: step lengths x_L and D - x_L (m), and walking speed D / sum T (m/s).

use super::program_data::GaitProgram;
use super::sparse_entries::Entries;

fn stride_time(program: &GaitProgram, x: &[f64]) -> f64 {
    program.layout.domains.iter().map(|d| program.layout.value(x, d.duration)).sum()
}

/// Values.
pub(super) fn values(program: &GaitProgram, x: &[f64], g: &mut [f64]) {
    let layout = &program.layout;
    let right_step = layout.value(x, layout.right_step_length);
    let stride = layout.value(x, layout.stride_length);
    g[program.rows.step_length] = right_step;
    g[program.rows.step_length + 1] = stride - right_step;
    g[program.rows.speed] = stride / stride_time(program, x);
}

/// Jacobian.
pub(super) fn jacobian(program: &GaitProgram, x: &[f64], out: &mut Entries<'_>) {
    let layout = &program.layout;
    out.jacobian(program.rows.step_length, layout.right_step_length, 1.0);
    out.jacobian(program.rows.step_length + 1, layout.right_step_length, -1.0);
    out.jacobian(program.rows.step_length + 1, layout.stride_length, 1.0);
    let time = stride_time(program, x);
    let stride = layout.value(x, layout.stride_length);
    out.jacobian(program.rows.speed, layout.stride_length, 1.0 / time);
    for domain in &layout.domains {
        out.jacobian(program.rows.speed, domain.duration, -stride / (time * time));
    }
}

/// Hessian.
pub(super) fn hessian(program: &GaitProgram, x: &[f64], multipliers: &[f64], out: &mut Entries<'_>) {
    let layout = &program.layout;
    let weight = multipliers[program.rows.speed];
    let time = stride_time(program, x);
    let stride = layout.value(x, layout.stride_length);
    for (i, domain) in layout.domains.iter().enumerate() {
        out.hessian(domain.duration, layout.stride_length, -weight / (time * time));
        for other in &layout.domains[..=i] {
            out.hessian(domain.duration, other.duration, 2.0 * weight * stride / (time * time * time));
        }
    }
}
