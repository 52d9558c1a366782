//! A first guess that needs nothing from the user: posture from the reference, motion, torques and muscles from it.
//!
//! 1. [`posture`]: joint angles near the reference with exact contacts (sequential convex QPs, clarabel);
//! 2. [`motion`]: Bezier fits per domain, their derivatives, contact-consistent torques and forces (least squares);
//! 3. [`muscles`]: non-negative muscle forces (convex QPs, clarabel), then tendon, fibre, activation.
//!
//! None of it can fail: where the bounds leave a convex part no solution, it gives the nearest thing to one, and the
//! gait problem decides whether there is a gait.

pub mod motion;
pub mod muscles;
pub mod posture;

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
