//! A first guess that needs nothing from the user: posture from the reference, motion, torques and muscles from it.
//!
//! 1. [`posture`]: joint angles near the reference with exact contacts (sequential convex QPs, clarabel);
//! 2. [`motion`]: Bezier fits per domain, their derivatives, contact-consistent torques and forces (least squares);
//! 3. [`muscles`]: non-negative muscle forces (convex QPs, clarabel), then tendon, fibre, activation.

pub mod motion;
pub mod muscles;
pub mod posture;

use thiserror::Error;

/// Stride time and length of a guess.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuessSettings {
    /// Stride time, s.
    pub stride_time_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
}

impl Default for GuessSettings {
    fn default() -> Self {
        Self { stride_time_s: 1.2, stride_length_m: 1.15 }
    }
}

/// A convex sub-problem of the cold start that has no solution.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ColdStartError {
    /// Clarabel did not solve a sub-problem.
    #[error("{what}: {status}")]
    SubProblem {
        /// Which.
        what: &'static str,
        /// Clarabel's words.
        status: String,
    },
}
