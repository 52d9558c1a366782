//! How the gait problem depends on a tuned bound.

use crate::gait_problem::{GaitProblem, GaitProgram};
use crate::model_error::ModelError;
use crate::solve::WarmStart;
use crate::tuned_bounds::TunedBounds;
use interior_point::{NonlinearProgram, ParameterDerivative};

/// Step of the differences, as a share of the allowed range of a bound. Bounds and rows are piecewise linear in the tuned
/// bounds, so that differences are exact up to rounding.
const STEP: f64 = 1e-6;

/// The derivatives of the program with respect to a tuned bound.
pub(super) fn program_derivative(
    problem: &GaitProblem,
    program: &GaitProgram,
    solution: &WarmStart,
    bound: usize,
) -> Result<ParameterDerivative, ModelError> {
    let (low, high) = TunedBounds::RANGES[bound];
    let step = STEP * (high - low);
    let value = problem.bounds.to_array()[bound];
    // One-sided at the ends of the range.
    let (least, most) = ((value - step).max(low), (value + step).min(high));
    let moved = |to: f64| -> Result<Parts, ModelError> {
        let mut values = problem.bounds.to_array();
        values[bound] = to;
        let bounds = TunedBounds::from_array(values)?;
        let moved = GaitProblem { bounds, ..problem.clone() }.program(problem.muscles)?;
        Ok(Parts::new(&moved.tightened(&solution.margins), solution))
    };
    let (more, less) = (moved(most)?, moved(least)?);
    let difference = |of: fn(&Parts) -> &Vec<f64>| -> Vec<f64> {
        let pairs = of(&more).iter().zip(of(&less));
        // Infinite bounds do not move.
        pairs.map(|(more, less)| if more == less { 0.0 } else { (more - less) / (most - least) }).collect()
    };
    Ok(ParameterDerivative {
        lagrangian_gradient: difference(|parts| &parts.lagrangian_gradient),
        rows: difference(|parts| &parts.rows),
        lower: difference(|parts| &parts.lower),
        upper: difference(|parts| &parts.upper),
        row_lower: difference(|parts| &parts.row_lower),
        row_upper: difference(|parts| &parts.row_upper),
        // The objective does not depend on tuned bounds.
        ..ParameterDerivative::zeros(program.variables(), program.rows())
    })
}

/// The parts of a program that can depend on a tuned bound, at the point of a solution.
struct Parts {
    lagrangian_gradient: Vec<f64>,
    rows: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    row_lower: Vec<f64>,
    row_upper: Vec<f64>,
}

impl Parts {
    fn new(program: &GaitProgram, solution: &WarmStart) -> Self {
        let (n, m) = (program.variables(), program.rows());
        let (x, y) = (&solution.point.x, &solution.point.row_multipliers);
        let zeros = |length| vec![0.0; length];
        let mut parts = Self {
            lagrangian_gradient: zeros(n),
            rows: zeros(m),
            lower: zeros(n),
            upper: zeros(n),
            row_lower: zeros(m),
            row_upper: zeros(m),
        };
        program.variable_bounds(&mut parts.lower, &mut parts.upper);
        program.row_bounds(&mut parts.row_lower, &mut parts.row_upper);
        program.constraints(x, &mut parts.rows);
        program.gradient(x, &mut parts.lagrangian_gradient);
        let pattern = program.jacobian_pattern();
        let mut jacobian = zeros(pattern.row_indices.len());
        program.jacobian(x, &mut jacobian);
        for j in 0..n {
            for q in pattern.column_starts[j]..pattern.column_starts[j + 1] {
                parts.lagrangian_gradient[j] += jacobian[q] * y[pattern.row_indices[q]];
            }
        }
        parts
    }
}
