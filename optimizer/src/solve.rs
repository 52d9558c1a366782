//! The public face: one gait problem in, one honest outcome out.

use crate::bounds::TunedBounds;
use crate::device::Device;
use crate::gait::Gait;
use crate::reference::ReferenceGait;
use crate::settings::GaitSettings;
use crate::subject::{ModelError, Subject};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use thiserror::Error;

/// One gait problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaitProblem {
    /// Who walks.
    pub subject: Subject,
    /// With which prosthesis (right leg).
    pub device: Device,
    /// Tuned bounds a1..a8.
    pub bounds: TunedBounds,
    /// With muscles (C1-C12) or without (C1-C4).
    pub muscles: bool,
    /// Other settings of the problem.
    pub settings: GaitSettings,
    /// Reference for Gait RMSE and for the cold start.
    pub reference: ReferenceGait,
}

/// How a solve ended. Only `Converged` is a gait that satisfies every constraint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SolveStatus {
    /// First-order optimal and feasible to tolerance.
    Converged,
    /// The constraint violation is at a stationary point: locally infeasible.
    Infeasible,
    /// No further progress could be made.
    Stalled,
    /// Iteration limit reached.
    IterationLimit,
    /// Time limit reached.
    TimeLimit,
    /// Cancelled through the token.
    Cancelled,
}

/// One line of progress.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct IterationRecord {
    /// Iteration number over all phases of this solve.
    pub iteration: usize,
    /// Phase of the solve: `tracking`, `muscle_tracking`, `cost`, ...
    pub phase: Phase,
    /// Objective of the phase.
    pub objective: f64,
    /// Largest violation of a scaled constraint row.
    pub constraint_violation: f64,
    /// Largest entry of the dual infeasibility.
    pub dual_infeasibility: f64,
    /// Barrier parameter.
    pub barrier: f64,
    /// Primal step length.
    pub step: f64,
}

/// Phase of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Tracking the reference without muscles (cold start).
    Tracking,
    /// Tracking the reference with muscles (cold start).
    MuscleTracking,
    /// Minimising the cost of transport.
    Cost,
}

/// Stops a solve from another thread within one iteration.
#[derive(Debug, Clone, Default)]
pub struct CancelToken(Arc<AtomicBool>);

impl CancelToken {
    /// A token that is not cancelled.
    pub fn new() -> Self {
        Self::default()
    }
    /// Asks every solve that holds this token to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
    /// Whether [`Self::cancel`] was called.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Primal-dual point of an earlier solve of the same subject structure, mesh and variant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WarmStart {
    /// Scaled primal variables in the layout of the problem.
    pub variables: Vec<f64>,
    /// Multipliers of all constraint rows.
    pub multipliers: Vec<f64>,
    /// Multipliers of the lower variable bounds.
    pub lower_bound_multipliers: Vec<f64>,
    /// Multipliers of the upper variable bounds.
    pub upper_bound_multipliers: Vec<f64>,
}

/// Limits and numerical options of one solve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolveOptions {
    /// Scaled optimality tolerance.
    pub tolerance: f64,
    /// Most iterations of the final phase.
    pub max_iterations: usize,
    /// Most seconds of wall time for the whole solve; `None`: no limit.
    pub time_limit_s: Option<f64>,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self { tolerance: 1e-6, max_iterations: 1000, time_limit_s: None }
    }
}

/// The figures of one solve: a contract for scripts (`gaitwright solve --json`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolveReport {
    /// How it ended.
    pub status: SolveStatus,
    /// Interior-point iterations over all phases.
    pub iterations: usize,
    /// Objective: cost of transport plus regularisation.
    pub objective: f64,
    /// Mechanical cost of transport, dimensionless.
    pub cost_of_transport: f64,
    /// Gait RMSE: sum over the five human coordinates, rad.
    pub gait_rmse_rad: f64,
    /// Its parts: torso, hip_L, knee_L, ankle_L, hip_R.
    pub gait_rmse_parts_rad: [f64; 5],
    /// Largest violation of any constraint row or bound, in scaled units.
    pub max_violation: f64,
    /// Wall time, s.
    pub seconds_total: f64,
    /// Of which evaluating functions and derivatives.
    pub seconds_evaluation: f64,
    /// Of which factorising and solving.
    pub seconds_linear_algebra: f64,
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
    /// v_hip of the four impact-free runs, m/s.
    pub vhip_m_s: [f64; 4],
}

/// A constraint row or bound that is not met, in words and numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Violation {
    /// Name of the row: domain, node, constraint, component.
    pub row: String,
    /// By how much, in `unit`.
    pub amount: f64,
    /// Unit of `amount`.
    pub unit: String,
}

/// What a solve gives back, converged or not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolveOutcome {
    /// The figures.
    pub report: SolveReport,
    /// The last iterate as a gait. Only a gait to trust when the status is `Converged`.
    pub gait: Gait,
    /// For warm-starting another solve.
    pub warm_start: WarmStart,
    /// The most violated rows, worst first; empty when converged.
    pub violations: Vec<Violation>,
}

/// Why a solve could not even be tried.
#[derive(Debug, Error)]
pub enum SolveError {
    /// The input is not a valid problem.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The warm start does not belong to a problem of this shape.
    #[error("the warm start has {found} variables, this problem has {expected}: other mesh or other variant")]
    WarmStartShape {
        /// Variables of the warm start.
        found: usize,
        /// Variables of the problem.
        expected: usize,
    },
    /// A numerical sub-problem of the cold start could not be solved.
    #[error("cold start: {0}")]
    ColdStart(String),
}

/// Solves one gait problem. Deterministic: same inputs, same bits.
///
/// `observer` is called once per iteration, on the calling thread. A solve that ends without a gait is an
/// `Ok` outcome with another status than `Converged`.
///
/// # Errors
/// [`SolveError`] when the input is invalid.
pub fn solve(
    problem: &GaitProblem,
    warm_start: Option<&WarmStart>,
    options: &SolveOptions,
    observer: &mut dyn FnMut(&IterationRecord),
    cancel: &CancelToken,
) -> Result<SolveOutcome, SolveError> {
    let _ = (warm_start, options, observer, cancel);
    problem.subject.validate()?;
    Err(SolveError::ColdStart("under construction".to_owned()))
}
