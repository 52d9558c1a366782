//! Solver runs with their results, and warm starts.

use super::error::SolveError;
use super::phases::{RunInProgress, SolveContext};
use super::progress::{IterationRecord, SolvePhase};
use super::solve_report::{CONVERGED_VIOLATION, LinearAlgebra, SolveStatus, SolverRun};
use super::warm_start::MeshStart;
use crate::gait::Gait;
use crate::gait_problem::gait_of;
use crate::gait_problem::margins::Margins;
use crate::gait_rmse::gait_rmse;
use interior_point::{NlpResult, NonlinearProgram};

/// A result with the quantities that decide the choice.
pub(super) struct Candidate {
    pub(super) result: NlpResult,
    pub(super) gait: Gait,
    pub(super) status: SolveStatus,
    pub(super) objective: f64,
    pub(super) rmse: f64,
    pub(super) violation: f64,
}

impl Candidate {
    /// Measures the residuals after projection into the bounds, because the solver relaxes bounds by 1e-8.
    pub(super) fn new(context: &SolveContext<'_>, mut result: NlpResult) -> Self {
        let program = context.program;
        program.project_into_bounds(&mut result.x);
        let gait = gait_of(context.problem, program, &result.x);
        let violation = program.violations(&result.x).first().map_or(0.0, |v| v.amount);
        let mut status = SolveStatus::from(result.status);
        let met = violation <= CONVERGED_VIOLATION; // False for NaN.
        if status == SolveStatus::Converged && !met {
            status = SolveStatus::Stalled;
        }
        Self {
            objective: program.objective(&result.x),
            rmse: gait_rmse(&gait, &context.problem.reference).total,
            violation,
            status,
            gait,
            result,
        }
    }

    pub(super) fn run(&self, strategy: &str, run: &RunInProgress<'_>) -> SolverRun {
        SolverRun {
            strategy: strategy.to_owned(),
            status: self.status,
            iterations: run.iterations,
            seconds: run.seconds(),
            objective: self.objective,
            gait_rmse_rad: self.rmse,
            reason: run.reason.clone(),
            local_optimum: None,
            chosen: false,
        }
    }
}

/// A finished run.
pub(super) struct FinishedRun {
    pub(super) candidate: Candidate,
    pub(super) run: SolverRun,
    /// Tightened bounds.
    pub(super) margins: Margins,
    pub(super) evaluation_s: f64,
    pub(super) linear_algebra: LinearAlgebra,
}

impl FinishedRun {
    /// Whether no further run is needed: it converged or was stopped.
    pub(super) fn is_final(&self) -> bool {
        matches!(self.candidate.status, SolveStatus::Converged | SolveStatus::Cancelled | SolveStatus::TimeLimit)
    }

    pub(super) fn new(
        context: &SolveContext<'_>,
        result: NlpResult,
        strategy: &str,
        margins: Margins,
        run: &RunInProgress<'_>,
    ) -> Self {
        let candidate = Candidate::new(context, result);
        Self {
            run: candidate.run(strategy, run),
            margins,
            evaluation_s: run.evaluation_s,
            linear_algebra: run.linear_algebra,
            candidate,
        }
    }
}

/// Tries a warm start with its tightened bounds. It has the same iteration limit as other runs, because slow
/// progress does not predict failure (docs/benchmarks/optimizer.md, warm starts that fail).
pub(super) fn try_warm(
    context: &SolveContext<'_>,
    start: MeshStart,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<FinishedRun, SolveError> {
    let mut run = RunInProgress::new(context, context.options.threads, observer);
    let MeshStart { point, mut margins, strategy } = start;
    if context.options.tightening_rounds == 0 {
        margins = Margins::default();
    }
    let result = if margins.is_empty() {
        run.warm(SolvePhase::Cost, context.program, point)
    } else {
        run.warm(SolvePhase::InterNode, &context.program.tightened(&margins), point)
    }?;
    Ok(FinishedRun::new(context, result, strategy, margins, &run))
}
