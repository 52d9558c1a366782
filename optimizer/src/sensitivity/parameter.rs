//! How the gait problem depends on a tuned bound, and how its solution follows.

use super::active::{self, ActiveSet};
use super::bound_sensitivity::{BoundSensitivity, GaitSensitivityError};
use super::result_derivatives::ResultDerivatives;
use crate::gait_problem::{ConvergedGait, GaitProblem, GaitProgram, UnchangedBound, gait_of};
use crate::model_error::ModelError;
use crate::solve::{GaitResults, SolveError, SolveOptions, WarmStart, check_shape, final_settings};
use crate::tuned_bounds::TunedBounds;
use interior_point::{NonlinearProgram, ParameterDerivative, Sensitivity};

/// Step of the differences, as a share of the allowed range of a bound. Bounds and rows are piecewise linear in the tuned
/// bounds, so that differences are exact up to rounding.
const STEP: f64 = 1e-6;

/// The program at a solution, how it depends on each tuned bound, and how the solution follows.
pub(super) struct PointSensitivities {
    pub(super) program: GaitProgram,
    parameters: Vec<ParameterDerivative>,
    sensitivities: Vec<Sensitivity>,
    /// Empty if the gait exceeds bounds between its nodes.
    unchanged_bounds: Vec<UnchangedBound>,
}

impl PointSensitivities {
    pub(super) fn new(
        problem: &GaitProblem,
        solution: &WarmStart,
        options: &SolveOptions,
    ) -> Result<Self, GaitSensitivityError> {
        let program = problem.program(problem.muscles).map_err(SolveError::from)?;
        if solution.muscles != problem.muscles || solution.mesh != problem.settings.mesh {
            return Err(
                SolveError::WarmStartShape("its variant or mesh differs from that of the problem".to_owned()).into()
            );
        }
        check_shape(&program, solution)?;
        let converged = ConvergedGait {
            problem,
            program: &program,
            margins: &solution.margins,
            gait: &gait_of(problem, &program, &solution.point.x),
            point: &solution.point,
            tolerance: options.tolerance,
            checks_between_nodes: options.tightening_rounds > 0,
        };
        let unchanged_bounds = converged.unchanged_bounds();
        let program = program.tightened(&solution.margins);
        let parameters: Result<Vec<_>, ModelError> =
            (0..TunedBounds::COUNT).map(|bound| parameter(problem, &program, solution, bound)).collect();
        let parameters = parameters.map_err(SolveError::from)?;
        let sensitivities =
            interior_point::sensitivities(&program, &solution.point, &final_settings(options), &parameters)?;
        Ok(Self { program, parameters, sensitivities, unchanged_bounds })
    }

    /// Mechanical cost of transport of the solution.
    pub(super) fn cost_of_transport(&self, problem: &GaitProblem, solution: &WarmStart) -> f64 {
        let gait = gait_of(problem, &self.program, &solution.point.x);
        GaitResults::of_well_formed(&gait, &self.program.model, &problem.reference).cost_of_transport
    }

    pub(super) fn of_bound(&self, problem: &GaitProblem, solution: &WarmStart, bound: usize) -> BoundSensitivity {
        let (parameter, sensitivity) = (&self.parameters[bound], &self.sensitivities[bound]);
        let value = problem.bounds.to_array()[bound];
        let set = ActiveSet::new(&self.program, &solution.point);
        let active = active::of_parameter(&self.program, &set, parameter);
        // Which of two limits is the stricter one can change beyond the point, which no derivative shows. For a bound that is
        // not active, the interval is known exactly.
        let interval = match self.unchanged_bounds.get(bound) {
            Some(unchanged) if active.is_empty() => (unchanged.least, unchanged.most),
            _ => {
                let (back, forth) = set.steps(parameter, &sensitivity.point);
                (back.map(|step| value + step), forth.map(|step| value + step))
            }
        };
        BoundSensitivity {
            bound: TunedBounds::NAMES[bound],
            value,
            active,
            derivatives: ResultDerivatives::along(problem, &self.program, &solution.point.x, sensitivity),
            interval,
            is_weakly_active: set.is_weak(parameter),
        }
    }
}

/// The derivatives of the program with respect to a tuned bound.
fn parameter(
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
