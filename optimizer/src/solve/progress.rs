//! Progress of a solve.

use serde::{Deserialize, Serialize};

/// The record of an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct IterationRecord {
    /// Number of the iteration over all phases of the solve.
    pub iteration: usize,
    /// Phase of the solve: `tracking`, `muscle_tracking`, `cost`, ...
    pub phase: SolvePhase,
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
    /// Number of the initial guess, from 0; several may run in parallel.
    #[serde(default)]
    pub guess: usize,
}

/// Phase of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SolvePhase {
    /// Tracking of the reference gait without muscles, in a cold start.
    Tracking,
    /// Tracking of the reference gait with muscles, in a cold start.
    MuscleTracking,
    /// Minimisation of the cost of transport without muscles, before the phase with muscles of a cold start.
    PlainCost,
    /// Minimisation of the cost of transport.
    Cost,
    /// Minimisation of the cost of transport with tightened bounds.
    InterNode,
}
