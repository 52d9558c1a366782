//! What a solve tells while it runs, and how it is stopped.

use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

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
    /// Cold guess it belongs to, from 0; several may run at the same time.
    #[serde(default)]
    pub guess: usize,
}

/// Phase of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Tracking the reference without muscles (cold start).
    Tracking,
    /// Tracking the reference with muscles (cold start).
    MuscleTracking,
    /// Minimising the cost of transport without muscles, as the start of a gait with muscles (cold start).
    PlainCost,
    /// Minimising the cost of transport.
    Cost,
    /// The same with bounds tightened where the gait exceeded them between its nodes.
    BetweenPoints,
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
