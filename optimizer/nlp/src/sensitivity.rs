//! Parametric sensitivities of a solution: how the primal-dual point moves with a parameter of the program.
//!
//! At a solution with strict complementarity, linearly independent active constraints and a positive definite reduced
//! Hessian, the point is a smooth function of the parameters (Fiacco, *Introduction to Sensitivity and Stability Analysis in
//! Nonlinear Programming*, 1983, theorem 3.2.2). Its derivative solves the Newton system of the barrier problem with another
//! right-hand side (Pirnay, López-Negrete and Biegler, *Optimal sensitivity based on IPOPT*, Math. Program. Comput. 4, 2012),
//! so all parameters share one factorisation. The barrier parameter rounds off the derivative where a bound is about to
//! become active or inactive: there it is between the two one-sided derivatives.

use crate::barrier::smallest_mu;
use crate::factorisation::{self, KktMatrix, MatrixChange, check_blocks};
use crate::formulation::{Formulation, RowForm};
use crate::iterate::Iterate;
use crate::newton_system::NewtonSystem;
use crate::nonlinear_program::NonlinearProgram;
use crate::primal_dual::PrimalDual;
use crate::settings::NlpSettings;
use crate::solve::{StartDistances, check_start, place};
use crate::starting_point::{StartPoint, WarmPoint};
use crate::status::NlpError;
use thiserror::Error;

/// Derivatives of a program with respect to a parameter, at the solution.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterDerivative {
    /// Derivative of the objective.
    pub objective: f64,
    /// Derivative of the gradient of the Lagrangian f + y^T g, at fixed x and y (length n).
    pub lagrangian_gradient: Vec<f64>,
    /// Derivatives of the rows g (length m).
    pub rows: Vec<f64>,
    /// Derivatives of the lower bounds of the variables (length n).
    pub lower: Vec<f64>,
    /// Derivatives of the upper bounds of the variables (length n).
    pub upper: Vec<f64>,
    /// Derivatives of the lower bounds of the rows (length m).
    pub row_lower: Vec<f64>,
    /// Derivatives of the upper bounds of the rows (length m).
    pub row_upper: Vec<f64>,
}

impl ParameterDerivative {
    /// The derivative with respect to a parameter that has no effect on a program with `variables` and `rows`.
    pub fn zeros(variables: usize, rows: usize) -> Self {
        Self {
            objective: 0.0,
            lagrangian_gradient: vec![0.0; variables],
            rows: vec![0.0; rows],
            lower: vec![0.0; variables],
            upper: vec![0.0; variables],
            row_lower: vec![0.0; rows],
            row_upper: vec![0.0; rows],
        }
    }
}

/// Derivative of a solution with respect to a parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// Derivative of the primal-dual point; lengths and sign convention as in [`NlpResult`](crate::NlpResult).
    pub point: WarmPoint,
    /// Derivative of the objective.
    pub objective: f64,
    /// Relative residual of the linear system.
    pub residual: f64,
}

/// Why a solution has no sensitivities.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SensitivityError {
    /// Settings, problem or point are invalid.
    #[error(transparent)]
    Invalid(#[from] NlpError),
    /// A derivative has another length than its part of the program.
    #[error("the derivative of {what} has length {found}; it must be {expected}")]
    Length {
        /// Which derivative.
        what: &'static str,
        /// Its length.
        found: usize,
        /// Length of that part of the program.
        expected: usize,
    },
    /// A parameter moves the value of a fixed variable.
    #[error("sensitivities are undefined for a parameter that moves the fixed variable {0}, whose bounds are equal")]
    FixedVariable(usize),
    /// The point is no strict minimum of its active constraints, or these depend on each other.
    #[error(
        "the KKT matrix is singular or has the wrong inertia: the active constraints are dependent, or the point is not a strict local minimum"
    )]
    Irregular,
    /// No factorisation solves the linear system to the residual limit of the settings.
    #[error("the linear system could be solved only to a relative residual of {0:.1e}")]
    Inaccurate(f64),
}

/// Sensitivities of the solution `point` of `problem` with respect to each parameter. `settings` are those of the solve.
///
/// # Errors
/// [`SensitivityError`] if the input is invalid or the solution is not regular.
pub fn sensitivities(
    problem: &dyn NonlinearProgram,
    point: &WarmPoint,
    settings: &NlpSettings,
    parameters: &[ParameterDerivative],
) -> Result<Vec<Sensitivity>, SensitivityError> {
    settings.validate()?;
    let mut form = Formulation::new(problem, settings)?;
    if let Some(blocks) = problem.elimination_blocks() {
        check_blocks(&form, blocks)?;
    }
    let start = StartPoint::Warm(point.clone());
    check_start(&form, &start)?;
    for parameter in parameters {
        check_lengths(&form, parameter)?;
    }
    // The point is used as it is.
    let pushes = StartDistances { bound: 0.0, multiplier: f64::MIN_POSITIVE };
    let at = place(&mut form, &start, settings, pushes);
    let mu = smallest_mu(settings, form.objective_scale);
    let mut iterate = Iterate::new(form, at, mu);
    iterate.evaluate();
    iterate.form.hessian(&iterate.point.w, Some(&iterate.point.y), &mut iterate.at.hessian);
    let matrix = KktMatrix::new(&iterate.form);
    let solver = factorisation::choose(&iterate.form, &matrix, settings)?;
    let mut system = NewtonSystem::new(matrix, solver);
    system.fit(&iterate.form);
    loop {
        factorise(&iterate, &mut system)?;
        let found =
            parameters.iter().map(|parameter| sensitivity(&iterate, settings, &mut system, parameter)).collect();
        // Another factorisation may be more accurate.
        if !matches!(found, Err(SensitivityError::Inaccurate(_))) || !system.reject_factorisation() {
            return found;
        }
    }
}

fn check_lengths(form: &Formulation, parameter: &ParameterDerivative) -> Result<(), SensitivityError> {
    for (what, values, expected) in [
        ("the gradient of the Lagrangian", &parameter.lagrangian_gradient, form.n),
        ("the rows", &parameter.rows, form.m),
        ("the lower bounds", &parameter.lower, form.n),
        ("the upper bounds", &parameter.upper, form.n),
        ("the lower row bounds", &parameter.row_lower, form.m),
        ("the upper row bounds", &parameter.row_upper, form.m),
    ] {
        if values.len() != expected {
            return Err(SensitivityError::Length { what, found: values.len(), expected });
        }
    }
    let moved = |j: &usize| form.fixed[*j].is_some() && (parameter.lower[*j] != 0.0 || parameter.upper[*j] != 0.0);
    (0..form.n).find(moved).map_or(Ok(()), |j| Err(SensitivityError::FixedVariable(j)))
}

/// Factorises the Newton system without regularisation.
fn factorise(iterate: &Iterate, system: &mut NewtonSystem) -> Result<(), SensitivityError> {
    loop {
        let inertia = system.factor(&iterate.form, &iterate.point, &iterate.at, (0.0, 0.0), MatrixChange::Any);
        if inertia.is_some_and(|inertia| inertia.zero == 0 && inertia.negative == iterate.form.m) {
            return Ok(());
        }
        if !system.reject_factorisation() {
            return Err(SensitivityError::Irregular);
        }
    }
}

fn sensitivity(
    iterate: &Iterate,
    settings: &NlpSettings,
    system: &mut NewtonSystem,
    parameter: &ParameterDerivative,
) -> Result<Sensitivity, SensitivityError> {
    let form = &iterate.form;
    let rhs = right_hand_side(iterate, parameter);
    let mut direction = PrimalDual::zeros(form);
    let solved = system.solve(form, settings, &iterate.point, &iterate.at, &rhs, &mut direction);
    if solved.refined > settings.constants.residual_limit {
        return Err(SensitivityError::Inaccurate(solved.refined));
    }
    let along: f64 = iterate.gradient.iter().zip(&direction.w).map(|(gradient, dw)| gradient * dw).sum();
    Ok(Sensitivity {
        objective: parameter.objective + along / form.objective_scale,
        residual: solved.refined,
        point: in_units_of_the_problem(form, &direction),
    })
}

/// Minus the derivative of the optimality conditions with respect to the parameter, in the scaling of the formulation.
fn right_hand_side(iterate: &Iterate, parameter: &ParameterDerivative) -> PrimalDual {
    let form = &iterate.form;
    let mut rhs = PrimalDual::zeros(form);
    for j in 0..form.n {
        rhs.w[j] = -form.objective_scale * parameter.lagrangian_gradient[j];
        rhs.zl[j] = iterate.point.zl[j] * parameter.lower[j];
        rhs.zu[j] = -iterate.point.zu[j] * parameter.upper[j];
    }
    for i in 0..form.m {
        let scale = form.row_scale[i];
        rhs.y[i] = -scale * parameter.rows[i];
        match form.rows[i] {
            RowForm::Equality(_) => rhs.y[i] += scale * parameter.row_lower[i],
            RowForm::Inequality(k) => {
                let j = form.n + k;
                rhs.zl[j] = iterate.point.zl[j] * scale * parameter.row_lower[i];
                rhs.zu[j] = -iterate.point.zu[j] * scale * parameter.row_upper[i];
            }
            RowForm::Free => rhs.y[i] = 0.0,
        }
    }
    rhs
}

fn in_units_of_the_problem(form: &Formulation, direction: &PrimalDual) -> WarmPoint {
    let (n, f) = (form.n, form.objective_scale);
    let of_slack = |values: &[f64], to_problem: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
        let value = |i: usize| match form.rows[i] {
            RowForm::Inequality(k) => to_problem(values[n + k], form.row_scale[i]),
            _ => 0.0,
        };
        (0..form.m).map(value).collect()
    };
    let unscaled = |values: &[f64]| values[..n].iter().map(|z| z / f).collect();
    WarmPoint {
        x: direction.w[..n].to_vec(),
        row_multipliers: direction.y.iter().zip(&form.row_scale).map(|(y, scale)| y * scale / f).collect(),
        lower_multipliers: unscaled(&direction.zl),
        upper_multipliers: unscaled(&direction.zu),
        slacks: of_slack(&direction.w, &|t, scale| t / scale),
        slack_lower_multipliers: of_slack(&direction.zl, &|z, scale| z * scale / f),
        slack_upper_multipliers: of_slack(&direction.zu, &|z, scale| z * scale / f),
    }
}
