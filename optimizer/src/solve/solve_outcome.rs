//! The outcome of a solve from its solver runs.

use super::gait_results::GaitResults;
use super::phases::SolveContext;
use super::solve_report::{
    CONVERGED_VIOLATION, LinearAlgebra, Optimality, OtherLocalOptimum, SolveOutcome, SolveReport, SolveStatus,
    SolverRun, StartedFrom, Violation,
};
use super::solver_runs::Candidate;
use super::warm_start::WarmStart;
use crate::gait_problem::margins::Margins;
use crate::gait_problem::{ConvergedGait, GaitProgram, RowViolation};
use interior_point::{NlpResult, NonlinearProgram};

/// Total cost of the runs of a solve.
#[derive(Default)]
pub(super) struct SolveTally {
    pub(super) iterations: usize,
    pub(super) evaluation_s: f64,
    pub(super) linear_algebra: LinearAlgebra,
    pub(super) solver_runs: Vec<SolverRun>,
}

/// Largest number of reported violations.
const MAX_VIOLATIONS: usize = 20;

/// The outcome of the chosen run.
pub(super) fn outcome(
    context: &SolveContext<'_>,
    candidate: Candidate,
    margins: &Margins,
    tally: SolveTally,
    started_from: StartedFrom,
) -> SolveOutcome {
    let (problem, program) = (context.problem, context.program);
    let Candidate { result, gait, status, .. } = candidate;
    let x = &result.x;
    let results = GaitResults::of_well_formed(&gait, &program.model, &problem.reference);
    let margins = margins.relevant_at(program, x);
    let violations = program.violations(x);
    let warm_start = warm_start(context, &result, margins);
    let converged = ConvergedGait {
        problem,
        program,
        margins: &warm_start.margins,
        gait: &gait,
        point: &warm_start.point,
        tolerance: context.options.tolerance,
        checks_between_nodes: context.options.tightening_rounds > 0,
    };
    let unchanged_bounds = if status == SolveStatus::Converged { converged.unchanged_bounds() } else { Vec::new() };
    let equalities = (0..program.rows()).filter(|&r| program.rows.lower[r] == program.rows.upper[r]).count();
    let report = SolveReport {
        status,
        started_from,
        iterations: tally.iterations,
        objective: program.objective(x),
        cost_of_transport: results.cost_of_transport,
        gait_rmse_rad: results.gait_rmse_rad,
        gait_rmse_parts_rad: results.gait_rmse_parts_rad,
        max_violation: violations.first().map_or(0.0, |v| v.amount),
        optimality: Some(Optimality {
            dual_infeasibility: result.scaled_residuals.dual_infeasibility,
            complementarity: result.scaled_residuals.complementarity,
            barrier: result.mu,
        })
        .filter(|o| o.dual_infeasibility.is_finite() && o.complementarity.is_finite()),
        tightened_bounds: warm_start.margins.count(),
        unchanged_bounds,
        seconds_total: context.started.elapsed().as_secs_f64(),
        seconds_evaluation: tally.evaluation_s,
        seconds_linear_algebra: tally.linear_algebra.seconds(),
        linear_algebra: Some(tally.linear_algebra),
        variables: program.variables(),
        equalities,
        inequalities: program.rows() - equalities,
        speed_m_s: results.speed_m_s,
        stride_length_m: results.stride_length_m,
        durations_s: results.durations_s,
        vhip_m_s: results.vhip_m_s,
        solver_runs: tally.solver_runs,
    };
    // NaN is a violation.
    let above = violations.iter().filter(|v| v.amount.is_nan() || v.amount > CONVERGED_VIOLATION);
    let violations = above.take(MAX_VIOLATIONS).map(|v| describe(program, v)).collect();
    SolveOutcome { report, gait, warm_start, violations, other_local_optima: Vec::new() }
}

/// The gait of another local optimum.
pub(super) fn other_local_optimum(
    context: &SolveContext<'_>,
    candidate: Candidate,
    run: &SolverRun,
    local_optimum: usize,
) -> OtherLocalOptimum {
    OtherLocalOptimum {
        local_optimum,
        objective: run.objective,
        gait_rmse_rad: run.gait_rmse_rad,
        warm_start: warm_start(context, &candidate.result, Margins::default()),
        gait: candidate.gait,
    }
}

fn warm_start(context: &SolveContext<'_>, result: &NlpResult, margins: Margins) -> WarmStart {
    let problem = context.problem;
    WarmStart { muscles: problem.muscles, mesh: problem.settings.mesh, point: result.warm_point(), margins }
}

fn describe(program: &GaitProgram, violation: &RowViolation) -> Violation {
    if let Some(row) = violation.row {
        let name = &program.rows.names[row];
        let (_, unit, scale) = name.kind.description();
        Violation { row: name.label(), amount: violation.amount * scale, unit: unit.to_owned() }
    } else {
        let variable = violation.variable.unwrap_or(0);
        let (label, unit) = program.layout.variable_label(variable);
        Violation { row: label, amount: violation.amount * program.layout.scale[variable], unit: unit.to_owned() }
    }
}
