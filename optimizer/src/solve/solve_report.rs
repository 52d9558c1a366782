//! The outcome of a solve: report, gait and violations.

use super::warm_start::WarmStart;
use crate::gait::Gait;
use crate::gait_problem::UnchangedBound;
use interior_point::{NlpResult, NlpStatus};
use serde::{Deserialize, Serialize};

/// Largest scaled violation of a converged gait.
pub const CONVERGED_VIOLATION: f64 = 1e-6;

/// Status of a solve. Only a `Converged` gait satisfies every constraint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SolveStatus {
    /// A feasible point that satisfies the first-order conditions to tolerance.
    Converged,
    /// A stationary point of the violation: the problem is locally infeasible.
    Infeasible,
    /// The solver could not make progress.
    Stalled,
    /// The iteration limit was reached.
    IterationLimit,
    /// The time limit was reached.
    TimeLimit,
    /// The solve was cancelled.
    Cancelled,
}

impl From<NlpStatus> for SolveStatus {
    fn from(status: NlpStatus) -> Self {
        match status {
            NlpStatus::Converged => SolveStatus::Converged,
            NlpStatus::Infeasible => SolveStatus::Infeasible,
            NlpStatus::IterationLimit => SolveStatus::IterationLimit,
            NlpStatus::TimeLimit => SolveStatus::TimeLimit,
            NlpStatus::Cancelled => SolveStatus::Cancelled,
            _ => SolveStatus::Stalled,
        }
    }
}

/// Start of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartedFrom {
    /// A cold start.
    Cold,
    /// The given warm start.
    Warm,
    /// A cold start, because the given warm start did not converge.
    ColdAfterWarm,
}

/// One run of the solver within a solve, from an initial guess or a warm start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolverRun {
    /// Label of the start.
    pub strategy: String,
    /// Status of the run.
    pub status: SolveStatus,
    /// Number of iterations over its phases.
    pub iterations: usize,
    /// Wall time, s.
    pub seconds: f64,
    /// Final objective.
    pub objective: f64,
    /// Final Gait RMSE, rad.
    pub gait_rmse_rad: f64,
    /// The reason why the run could not be completed; empty otherwise.
    #[serde(default)]
    pub reason: String,
    /// Number of its local optimum, from 1 in the order of the runs. Runs with the same number have the same
    /// gait. `None` if it did not converge.
    #[serde(default)]
    pub local_optimum: Option<usize>,
    /// Whether it is the outcome of the solve.
    pub chosen: bool,
}

/// Residuals of the first-order conditions at the result, computed independently with the scaling of Wächter and
/// Biegler (2006, eq. 5), for the problem with tightened bounds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Optimality {
    /// Largest entry of the gradient of the Lagrangian.
    pub dual_infeasibility: f64,
    /// Largest complementarity product: distance from a bound times its multiplier.
    pub complementarity: f64,
    /// Last barrier parameter.
    pub barrier: f64,
}

/// Cost of the linear algebra of a solve, over all runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct LinearAlgebra {
    /// Time of the symbolic analyses, one for each phase, s.
    pub seconds_analysis: f64,
    /// Time of assembly and factorisation, s.
    pub seconds_factorisation: f64,
    /// Time of substitutions, residuals and refinement, s.
    pub seconds_solves: f64,
    /// Number of numerical factorisations.
    pub factorisations: usize,
    /// Number of forward and backward substitutions, including refinement.
    pub substitutions: usize,
    /// Number of factorisations that the fallback method replaced.
    pub fallbacks: usize,
}

impl LinearAlgebra {
    /// Adds the cost of a phase.
    pub(super) fn add_phase(&mut self, result: &NlpResult) {
        self.add(&Self {
            seconds_analysis: result.timing.analysis,
            seconds_factorisation: result.timing.factorisation,
            seconds_solves: result.timing.backsolves,
            factorisations: result.counts.factorisations,
            substitutions: result.counts.backsolves,
            fallbacks: result.counts.solver_fallbacks,
        });
    }

    /// Adds the cost of another run.
    pub(super) fn add(&mut self, other: &Self) {
        self.seconds_analysis += other.seconds_analysis;
        self.seconds_factorisation += other.seconds_factorisation;
        self.seconds_solves += other.seconds_solves;
        self.factorisations += other.factorisations;
        self.substitutions += other.substitutions;
        self.fallbacks += other.fallbacks;
    }

    pub(super) fn seconds(&self) -> f64 {
        self.seconds_analysis + self.seconds_factorisation + self.seconds_solves
    }
}

/// The report of a solve, and the format of `gaitwright solve --json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolveReport {
    /// How it ended.
    pub status: SolveStatus,
    /// Start of the solve.
    pub started_from: StartedFrom,
    /// Number of iterations over all phases.
    pub iterations: usize,
    /// Objective: smoothed cost of transport plus regularisation and naturalness terms.
    pub objective: f64,
    /// Mechanical cost of transport, from absolute joint powers; dimensionless.
    pub cost_of_transport: f64,
    /// Gait RMSE: sum over the five human coordinates, rad.
    pub gait_rmse_rad: f64,
    /// Parts of the Gait RMSE: torso, hip_L, knee_L, ankle_L, hip_R, rad.
    pub gait_rmse_parts_rad: [f64; 5],
    /// Largest violation of any constraint row or bound, in scaled units.
    pub max_violation: f64,
    /// Residuals of the first-order conditions; `None` if unknown.
    #[serde(default)]
    pub optimality: Option<Optimality>,
    /// Number of bounds at nodes that are tightened so that the gait satisfies them between nodes.
    #[serde(default)]
    pub tightened_bounds: usize,
    /// For each tuned bound, the values with which a converged gait stays a solution, whatever the others are in their
    /// intervals; empty if unknown.
    #[serde(default)]
    pub unchanged_bounds: Vec<UnchangedBound>,
    /// Wall time, s.
    pub seconds_total: f64,
    /// Time of function and derivative evaluations, s. This and the following times are sums over runs, which may
    /// exceed the wall time.
    pub seconds_evaluation: f64,
    /// Time of the linear algebra, s.
    pub seconds_linear_algebra: f64,
    /// Parts of the linear algebra; `None` if unknown.
    #[serde(default)]
    pub linear_algebra: Option<LinearAlgebra>,
    /// Number of variables.
    pub variables: usize,
    /// Number of equality rows.
    pub equalities: usize,
    /// Number of inequality rows.
    pub inequalities: usize,
    /// Mean walking speed, m/s.
    pub speed_m_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
    /// Durations of the eight domains, s.
    pub durations_s: [f64; 8],
    /// v_hip of the four sequences of domains without impact, m/s.
    pub vhip_m_s: [f64; 4],
    /// The runs in order. Iterations and times above are sums, the other values are those of the chosen run.
    #[serde(default)]
    pub solver_runs: Vec<SolverRun>,
}

/// A violated constraint row or bound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Violation {
    /// Name of the row: domain, node, constraint and component.
    pub row: String,
    /// Violation, in `unit`.
    pub amount: f64,
    /// Unit of `amount`.
    pub unit: String,
}

/// Another local optimum that a guess of the solve reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OtherLocalOptimum {
    /// Number of the local optimum among the runs.
    pub local_optimum: usize,
    /// Objective.
    pub objective: f64,
    /// Gait RMSE, rad.
    pub gait_rmse_rad: f64,
    /// The gait, which satisfies its bounds at nodes. A solve from `warm_start` also tightens them between nodes.
    pub gait: Gait,
    /// Warm start in this local optimum.
    pub warm_start: WarmStart,
}

/// The outcome of a solve, converged or not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolveOutcome {
    /// The report.
    pub report: SolveReport,
    /// The last iterate as a gait. It satisfies the constraints only if the status is `Converged`.
    pub gait: Gait,
    /// Warm start for another solve.
    pub warm_start: WarmStart,
    /// The rows with violations above [`CONVERGED_VIOLATION`], worst first, at most 20; empty if converged.
    pub violations: Vec<Violation>,
    /// The other local optima, with one gait for each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other_local_optima: Vec<OtherLocalOptimum>,
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{LinearAlgebra, SolveReport};
    use serde_json::{Value, json};

    fn older() -> Value {
        json!({
            "status": "converged", "started_from": "cold", "iterations": 3, "objective": 0.06, "cost_of_transport": 0.05,
            "gait_rmse_rad": 0.5, "gait_rmse_parts_rad": [0.1, 0.1, 0.1, 0.1, 0.1], "max_violation": 1e-9,
            "seconds_total": 1.0, "seconds_evaluation": 0.1, "seconds_linear_algebra": 0.8, "variables": 8,
            "equalities": 4, "inequalities": 2, "speed_m_s": 1.0, "stride_length_m": 1.1,
            "durations_s": [0.1, 0.1, 0.3, 0.1, 0.1, 0.1, 0.3, 0.1], "vhip_m_s": [1.0, 1.0, 1.0, 1.0]
        })
    }

    #[test]
    fn report_without_linear_algebra_and_optimality_is_read() {
        let report: SolveReport = serde_json::from_value(older()).unwrap();
        assert_eq!((report.seconds_linear_algebra, report.linear_algebra), (0.8, None));
    }

    #[test]
    fn linear_algebra_statistics_are_summed() {
        let one = LinearAlgebra {
            seconds_analysis: 0.25,
            seconds_factorisation: 0.5,
            seconds_solves: 0.125,
            factorisations: 3,
            substitutions: 7,
            fallbacks: 1,
        };
        let mut sum = one;
        sum.add(&one);
        assert_eq!(sum.seconds(), 2.0 * one.seconds());
        assert_eq!((sum.factorisations, sum.substitutions, sum.fallbacks), (6, 14, 2));
    }
}
