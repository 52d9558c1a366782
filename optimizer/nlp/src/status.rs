//! Iteration records, exit status, result and errors of a solve.

use thiserror::Error;

use crate::starting_point::WarmPoint;

/// Why the solver stopped. Only `Converged` is a solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NlpStatus {
    /// All tolerances are met.
    Converged,
    /// Locally infeasible: the restoration phase converged to a stationary point of the l1 violation, above its
    /// tolerance. (A nonconvex problem may be feasible elsewhere.)
    Infeasible,
    /// No further progress; nothing is known about the problem.
    Stalled,
    /// The iterates diverge; the objective is probably unbounded below.
    Unbounded,
    /// [`max_iterations`](crate::NlpSettings::max_iterations) is reached.
    IterationLimit,
    /// [`max_seconds`](crate::NlpSettings::max_seconds) is reached. The point depends on the speed of the machine.
    TimeLimit,
    /// The caller cancelled the solve.
    Cancelled,
}

/// Phase of an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NlpPhase {
    /// The problem itself.
    Regular,
    /// The restoration phase: the l1-elastic feasibility problem.
    Restoration,
}

/// The record of an iteration for the observer. In both phases violation and objective are unscaled and those of the
/// problem; dual infeasibility and complementarity are those of the formulation of the phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NlpIteration {
    /// Number of the iterate over both phases, from 0 (the start).
    pub number: usize,
    /// Phase.
    pub phase: NlpPhase,
    /// f(x).
    pub objective: f64,
    /// max violation of the rows.
    pub violation: f64,
    /// max |gradient of the Lagrangian|.
    pub dual_infeasibility: f64,
    /// max |bound distance * multiplier|.
    pub complementarity: f64,
    /// Barrier parameter.
    pub mu: f64,
    /// Last step length of x, slacks and row multipliers.
    pub alpha_primal: f64,
    /// Last step length of the bound multipliers.
    pub alpha_dual: f64,
    /// Regularisation of the Hessian in the last step.
    pub delta_w: f64,
    /// Regularisation of the rows in the last step.
    pub delta_c: f64,
    /// Trial points of the last line search, second-order corrections included.
    pub trials: usize,
}

/// Largest violations of the optimality conditions at a point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Residuals {
    /// max violation of row bounds and (unrelaxed) variable bounds.
    pub violation: f64,
    /// max |grad f + J^T y - z_L + z_U|.
    pub dual_infeasibility: f64,
    /// max |bound distance * multiplier|.
    pub complementarity: f64,
}

/// Wall time, s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Timing {
    /// Functions and derivatives of the problem.
    pub evaluation: f64,
    /// Analysis of the KKT structure.
    pub analysis: f64,
    /// Assembly of the KKT matrix and its numerical factorisations.
    pub factorisation: f64,
    /// Forward and backward substitutions, residuals and refinement.
    pub backsolves: f64,
    /// The whole solve.
    pub total: f64,
}

/// Counts of iterations and operations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NlpCounts {
    /// Iterations of the problem itself.
    pub regular_iterations: usize,
    /// Iterations of the restoration phase.
    pub restoration_iterations: usize,
    /// Entries into the restoration phase.
    pub restoration_phases: usize,
    /// Numerical factorisations.
    pub factorisations: usize,
    /// Forward-backward substitutions.
    pub backsolves: usize,
    /// Evaluations of g.
    pub constraint_evaluations: usize,
    /// Stored entries of the factor.
    pub factor_entries: usize,
    /// Changes to another factorisation after a breakdown or an inaccurate solution.
    pub solver_fallbacks: usize,
}

/// Outcome of a solve. Sign convention: L = f + y^T g - z_L^T (x - x_L) - z_U^T (x_U - x).
#[derive(Debug, Clone, PartialEq)]
pub struct NlpResult {
    /// Why the solver stopped.
    pub status: NlpStatus,
    /// x (length n).
    pub x: Vec<f64>,
    /// y (length m): >= 0 where the upper row bound is active, <= 0 where the lower one is.
    pub row_multipliers: Vec<f64>,
    /// z_L >= 0 (length n).
    pub lower_multipliers: Vec<f64>,
    /// z_U >= 0 (length n).
    pub upper_multipliers: Vec<f64>,
    /// Slack of each row (length m): the value of g_i within its bounds; for an equality its bound.
    pub slacks: Vec<f64>,
    /// Multipliers >= 0 of the slacks' lower bounds (length m, zero for equalities).
    pub slack_lower_multipliers: Vec<f64>,
    /// Multipliers >= 0 of the slacks' upper bounds (length m, zero for equalities).
    pub slack_upper_multipliers: Vec<f64>,
    /// f(x).
    pub objective: f64,
    /// Residuals in the problem's own units.
    pub residuals: Residuals,
    /// Residuals of the termination test: scaled by objective and row scaling and by the size of the multipliers
    /// (WB06 eq. 5).
    pub scaled_residuals: Residuals,
    /// Last barrier parameter.
    pub mu: f64,
    /// Iterations over both phases.
    pub iterations: usize,
    /// Counts.
    pub counts: NlpCounts,
    /// Times.
    pub timing: Timing,
}

impl NlpResult {
    /// The warm start for a similar problem.
    pub fn warm_point(&self) -> WarmPoint {
        WarmPoint {
            x: self.x.clone(),
            row_multipliers: self.row_multipliers.clone(),
            lower_multipliers: self.lower_multipliers.clone(),
            upper_multipliers: self.upper_multipliers.clone(),
            slacks: self.slacks.clone(),
            slack_lower_multipliers: self.slack_lower_multipliers.clone(),
            slack_upper_multipliers: self.slack_upper_multipliers.clone(),
        }
    }
}

/// A range in words.
fn range(low: f64, high: f64) -> String {
    match (low == f64::MIN_POSITIVE, high >= f64::MAX) {
        (true, true) => "a positive number".to_owned(),
        (true, false) => format!("more than 0 and at most {high}"),
        (false, true) => format!("at least {low}"),
        (false, false) => format!("{low} to {high}"),
    }
}

/// Why a solve could not start.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum NlpError {
    /// A setting is out of range.
    #[error("setting {field} is {value}; it must be {}", range(*low, *high))]
    InvalidSetting {
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Smallest allowed value.
        low: f64,
        /// Largest allowed value.
        high: f64,
    },
    /// A setting needs a feature that this build lacks.
    #[error("setting {field} is {value}, which needs the feature {feature}, but this program was built without it")]
    NotBuiltIn {
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: &'static str,
        /// The feature.
        feature: &'static str,
    },
    /// The problem is inconsistent.
    #[error("invalid problem: {0}")]
    InvalidProblem(String),
    /// The start does not fit the problem.
    #[error("invalid start: {0}")]
    InvalidStart(String),
    /// A function is not finite at the start.
    #[error("{what} is not finite at the start (first at index {index})")]
    EvaluationFailed {
        /// Which function.
        what: &'static str,
        /// Index of the first offending entry.
        index: usize,
    },
    /// The KKT structure could not be analysed.
    #[error("the KKT matrix of order {order} could not be analysed: {reason}")]
    Analysis {
        /// Order of the matrix.
        order: usize,
        /// The reason.
        reason: String,
    },
}
