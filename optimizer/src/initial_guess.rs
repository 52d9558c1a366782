//! The initial guess of a cold start, computed from the reference gait.
//!
//! 1. [`posture`]: joint angles near the reference gait with exact contacts, by sequential convex QPs (Clarabel)
//! 2. [`guessed_motion`]: Bezier fits in each domain, their derivatives, and consistent torques and forces by least squares
//! 3. [`guessed_muscles`]: non-negative muscle forces by convex QPs (Clarabel), then tendon, fibre and activation
//!
//! No step fails: if bounds make a QP infeasible, its constraints are relaxed, and the gait problem decides whether a
//! gait exists.

pub mod guessed_motion;
pub mod guessed_muscles;
pub mod posture;

/// Stride time and length of an initial guess.
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
