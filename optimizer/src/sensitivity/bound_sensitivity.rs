//! The sensitivity of a gait with respect to a tuned bound: how its solution and its results follow.

use super::active_set::{self, ActiveConstraint, ActiveSet};
use super::program_derivatives::program_derivative;
use super::result_derivatives::ResultDerivatives;
use crate::gait_problem::{ConvergedGait, GaitProblem, GaitProgram, UnchangedBound, gait_of};
use crate::model_error::ModelError;
use crate::solve::{GaitResults, SolveError, SolveOptions, WarmStart, check_shape, final_settings};
use crate::tuned_bounds::TunedBounds;
use interior_point::{ParameterDerivative, Sensitivity, SensitivityError};
use serde::Serialize;
use thiserror::Error;

/// The sensitivities of a gait with respect to every tuned bound.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GaitSensitivities {
    /// Mechanical cost of transport of the gait.
    pub cost_of_transport: f64,
    /// One for each tuned bound, in the order of an action.
    pub bounds: Vec<BoundSensitivity>,
}

/// The sensitivity with respect to one tuned bound. Derivatives are per unit of the bound.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoundSensitivity {
    /// Name of the bound.
    pub bound: &'static str,
    /// Its value.
    pub value: f64,
    /// The constraints that it sets and that are active. Empty: small changes of the bound change nothing.
    pub active: Vec<ActiveConstraint>,
    /// Derivatives of the results of the gait.
    pub derivatives: ResultDerivatives,
    /// Values of the bound between which the active constraints stay the same, to first order; `None` if they do for every
    /// value in that direction. Exact for a bound that is not active: there the gait stays as it is.
    pub interval: (Option<f64>, Option<f64>),
    /// Whether a constraint is about to become active or inactive, in which case the derivatives on the two sides
    /// differ.
    pub is_weakly_active: bool,
}

/// Why a gait has no sensitivities.
#[derive(Debug, Error)]
pub enum GaitSensitivityError {
    /// The problem or the warm start is invalid.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The solution is not regular.
    #[error(transparent)]
    Sensitivity(#[from] SensitivityError),
}

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
            (0..TunedBounds::COUNT).map(|bound| program_derivative(problem, &program, solution, bound)).collect();
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
        let active = active_set::of_parameter(&self.program, &set, parameter);
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
