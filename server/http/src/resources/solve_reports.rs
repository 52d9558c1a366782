//! Reports and iterations of solves.

use gait_optimizer::SolvePhase;
use serde::Serialize;
use utoipa::ToSchema;

/// How a solve ended: `converged`, every constraint is satisfied; `infeasible`, at a local minimum of the violation,
/// with no gait near it; `stalled`, without further progress; `iteration_limit` and `time_limit`, at that limit;
/// `cancelled`, by a user or a program.
#[derive(Debug, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum SolveStatus {
    /// Every constraint is satisfied.
    Converged,
    /// A local minimum of the violation: no gait near it.
    Infeasible,
    /// No further progress.
    Stalled,
    /// The limit of iterations.
    IterationLimit,
    /// The limit of time.
    TimeLimit,
    /// Somebody cancelled it.
    Cancelled,
}

impl From<gait_optimizer::SolveStatus> for SolveStatus {
    fn from(status: gait_optimizer::SolveStatus) -> Self {
        match status {
            gait_optimizer::SolveStatus::Converged => Self::Converged,
            gait_optimizer::SolveStatus::Infeasible => Self::Infeasible,
            gait_optimizer::SolveStatus::Stalled => Self::Stalled,
            gait_optimizer::SolveStatus::IterationLimit => Self::IterationLimit,
            gait_optimizer::SolveStatus::TimeLimit => Self::TimeLimit,
            gait_optimizer::SolveStatus::Cancelled => Self::Cancelled,
        }
    }
}

/// Starting point of a solve: `cold`, initial guesses; `warm`, the given warm start; `cold_after_warm`, initial
/// guesses, after the given warm start did not converge.
#[derive(Debug, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum StartedFrom {
    /// Its own cold start.
    Cold,
    /// The warm start that was given.
    Warm,
    /// A cold start after the given warm start did not converge.
    ColdAfterWarm,
}

impl From<gait_optimizer::StartedFrom> for StartedFrom {
    fn from(start: gait_optimizer::StartedFrom) -> Self {
        match start {
            gait_optimizer::StartedFrom::Cold => Self::Cold,
            gait_optimizer::StartedFrom::Warm => Self::Warm,
            gait_optimizer::StartedFrom::ColdAfterWarm => Self::ColdAfterWarm,
        }
    }
}

/// Numerical results of one solve.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct SolveReport {
    /// How it ended.
    status: SolveStatus,
    /// Starting point of the solve.
    started_from: StartedFrom,
    /// Interior-point iterations over all phases.
    #[schema(value_type = u64)]
    iterations: usize,
    /// Objective: smoothed cost of transport plus regularisation and terms for natural walking.
    objective: f64,
    /// Mechanical cost of transport, from absolute joint powers; dimensionless.
    cost_of_transport: f64,
    /// Gait RMSE: sum over the five human coordinates, rad.
    gait_rmse_rad: f64,
    /// Parts of Gait RMSE: torso, `hip_L`, `knee_L`, `ankle_L`, `hip_R`.
    #[schema(value_type = Vec<f64>)]
    gait_rmse_parts_rad: [f64; 5],
    /// Largest violation of a constraint or of a limit on a variable, scaled.
    max_violation: f64,
    /// How well the conditions of a local optimum are met. Null if unknown.
    optimality: Option<Optimality>,
    /// Number of limits that were tightened at nodes, so that the gait satisfies them between the nodes as well.
    #[schema(value_type = u64)]
    tightened_bounds: usize,
    /// For each tuned bound, the range of values for which the gait remains a solution, even if several bounds change
    /// at once. Empty if the solve did not converge, or if unknown.
    unchanged_bounds: Vec<UnchangedBound>,
    /// Wall time, s.
    seconds_total: f64,
    /// Time for evaluating functions and derivatives, s.
    seconds_evaluation: f64,
    /// Time for linear algebra, s.
    seconds_linear_algebra: f64,
    /// Breakdown of the linear algebra. Null if unknown.
    linear_algebra: Option<LinearAlgebra>,
    /// Number of variables.
    #[schema(value_type = u64)]
    variables: usize,
    /// Number of equality constraints.
    #[schema(value_type = u64)]
    equalities: usize,
    /// Number of inequality constraints.
    #[schema(value_type = u64)]
    inequalities: usize,
    /// Mean walking speed, m/s.
    speed_m_s: f64,
    /// Stride length, m.
    stride_length_m: f64,
    /// Durations of the eight domains, s.
    #[schema(value_type = Vec<f64>)]
    durations_s: [f64; 8],
    /// Hip velocity in the four intervals between impacts, m/s.
    #[schema(value_type = Vec<f64>)]
    vhip_m_s: [f64; 4],
    /// All solver runs, in order.
    solver_runs: Vec<SolverRun>,
}

impl From<gait_optimizer::SolveReport> for SolveReport {
    fn from(report: gait_optimizer::SolveReport) -> Self {
        let gait_optimizer::SolveReport {
            status,
            started_from,
            iterations,
            objective,
            cost_of_transport,
            gait_rmse_rad,
            gait_rmse_parts_rad,
            max_violation,
            optimality,
            tightened_bounds,
            unchanged_bounds,
            seconds_total,
            seconds_evaluation,
            seconds_linear_algebra,
            linear_algebra,
            variables,
            equalities,
            inequalities,
            speed_m_s,
            stride_length_m,
            durations_s,
            vhip_m_s,
            solver_runs,
        } = report;
        Self {
            status: status.into(),
            started_from: started_from.into(),
            iterations,
            objective,
            cost_of_transport,
            gait_rmse_rad,
            gait_rmse_parts_rad,
            max_violation,
            optimality: optimality.map(Into::into),
            tightened_bounds,
            unchanged_bounds: unchanged_bounds.into_iter().map(Into::into).collect(),
            seconds_total,
            seconds_evaluation,
            seconds_linear_algebra,
            linear_algebra: linear_algebra.map(Into::into),
            variables,
            equalities,
            inequalities,
            speed_m_s,
            stride_length_m,
            durations_s,
            vhip_m_s,
            solver_runs: solver_runs.into_iter().map(Into::into).collect(),
        }
    }
}

/// A tuned bound and the range of its values for which a gait remains a solution.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct UnchangedBound {
    /// Name of the bound.
    bound: String,
    /// Smallest value, in the unit of the bound. Null if every smaller one leaves the gait as it is.
    least: Option<f64>,
    /// Largest value, in the unit of the bound. Null if every larger one leaves the gait as it is.
    most: Option<f64>,
}

impl From<gait_optimizer::UnchangedBound> for UnchangedBound {
    fn from(bound: gait_optimizer::UnchangedBound) -> Self {
        let gait_optimizer::UnchangedBound { bound, least, most } = bound;
        Self { bound, least, most }
    }
}

/// One run of the solver within a solve, from an initial guess or a warm start.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct SolverRun {
    /// Starting point and method in words, such as `warm start`.
    strategy: String,
    /// How it ended.
    status: SolveStatus,
    /// Iterations over its phases.
    #[schema(value_type = u64)]
    iterations: usize,
    /// Wall time, s.
    seconds: f64,
    /// Objective where it ended.
    objective: f64,
    /// Gait RMSE where it ended, rad.
    gait_rmse_rad: f64,
    /// Reason if it could not be completed; otherwise empty.
    reason: String,
    /// Number of the local optimum in which it ended, counted from 1; null if it did not converge.
    #[schema(value_type = Option<u64>)]
    local_optimum: Option<usize>,
    /// Whether its gait is the result of the solve.
    chosen: bool,
}

impl From<gait_optimizer::SolverRun> for SolverRun {
    fn from(run: gait_optimizer::SolverRun) -> Self {
        let gait_optimizer::SolverRun {
            strategy,
            status,
            iterations,
            seconds,
            objective,
            gait_rmse_rad,
            reason,
            local_optimum,
            chosen,
        } = run;
        Self {
            strategy,
            status: status.into(),
            iterations,
            seconds,
            objective,
            gait_rmse_rad,
            reason,
            local_optimum,
            chosen,
        }
    }
}

/// First-order conditions of a local optimum.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Optimality {
    /// Largest entry of the Lagrangian's gradient.
    dual_infeasibility: f64,
    /// Largest product of the distance to a limit and its multiplier.
    complementarity: f64,
    /// Last barrier parameter.
    barrier: f64,
}

impl From<gait_optimizer::solve::Optimality> for Optimality {
    fn from(optimality: gait_optimizer::solve::Optimality) -> Self {
        let gait_optimizer::solve::Optimality { dual_infeasibility, complementarity, barrier } = optimality;
        Self { dual_infeasibility, complementarity, barrier }
    }
}

/// Operations and times of the linear algebra of a solve.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct LinearAlgebra {
    /// Time for analysing the structure of matrices, s.
    seconds_analysis: f64,
    /// Time for assembling and factorising matrices, s.
    seconds_factorisation: f64,
    /// Time for substitutions, residuals and refinement, s.
    seconds_solves: f64,
    /// Number of numerical factorisations.
    #[schema(value_type = u64)]
    factorisations: usize,
    /// Number of forward and backward substitutions.
    #[schema(value_type = u64)]
    substitutions: usize,
    /// Number of factorisations that failed and were replaced by a fallback method.
    #[schema(value_type = u64)]
    fallbacks: usize,
}

impl From<gait_optimizer::LinearAlgebra> for LinearAlgebra {
    fn from(algebra: gait_optimizer::LinearAlgebra) -> Self {
        let gait_optimizer::LinearAlgebra {
            seconds_analysis,
            seconds_factorisation,
            seconds_solves,
            factorisations,
            substitutions,
            fallbacks,
        } = algebra;
        Self { seconds_analysis, seconds_factorisation, seconds_solves, factorisations, substitutions, fallbacks }
    }
}

/// A violated constraint of the gait problem.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Violation {
    /// The constraint in words: domain, node, constraint, component.
    row: String,
    /// Amount of the violation.
    amount: f64,
    /// Unit of the amount.
    unit: String,
}

impl From<gait_optimizer::Violation> for Violation {
    fn from(violation: gait_optimizer::Violation) -> Self {
        let gait_optimizer::Violation { row, amount, unit } = violation;
        Self { row, amount, unit }
    }
}

/// One iteration of a solve.
#[derive(Debug, Serialize, ToSchema)]
#[allow(clippy::struct_field_names)] // the number of the iteration
pub(crate) struct Iteration {
    /// Number of the iteration over all phases.
    #[schema(value_type = u64)]
    iteration: usize,
    /// Phase of the solve: `tracking` and `muscle_tracking`, tracking of the reference gait without and with muscles;
    /// `plain_cost`, minimisation of the cost of transport without muscles, which precedes the one with muscles; `cost`,
    /// minimisation of the cost of transport; `inter_node`, minimisation with tightened bounds.
    #[schema(value_type = String)]
    phase: SolvePhase,
    /// Objective of the phase.
    objective: f64,
    /// Largest violation of a scaled constraint.
    constraint_violation: f64,
    /// Largest entry of the dual infeasibility.
    dual_infeasibility: f64,
    /// Barrier parameter.
    barrier: f64,
    /// Primal step length.
    step: f64,
    /// Number of the initial guess to which this iteration belongs.
    #[schema(value_type = u64)]
    guess: usize,
}

impl From<gait_optimizer::IterationRecord> for Iteration {
    fn from(record: gait_optimizer::IterationRecord) -> Self {
        let gait_optimizer::IterationRecord {
            iteration,
            phase,
            objective,
            constraint_violation,
            dual_infeasibility,
            barrier,
            step,
            guess,
        } = record;
        Self { iteration, phase, objective, constraint_violation, dual_infeasibility, barrier, step, guess }
    }
}
