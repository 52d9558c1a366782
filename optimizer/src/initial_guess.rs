//! The initial guess of a cold start, computed from the reference gait.
//!
//! 1. [`posture`]: joint angles near the reference gait with exact contacts, by sequential convex QPs (Clarabel)
//! 2. [`guessed_motion`]: Bezier fits in each domain, their derivatives, and consistent torques and forces by least squares
//! 3. [`guessed_muscles`]: non-negative muscle forces by convex QPs (Clarabel), then tendon, fibre and activation
//!
//! No step fails: if bounds make a QP infeasible, its constraints are relaxed, and the gait problem decides whether a
//! gait exists.

use crate::gait_problem::GaitProgram;

pub mod guess_settings;
pub mod guessed_motion;
pub mod guessed_muscles;
pub mod posture;

pub use guess_settings::GuessSettings;

/// Steps 1 and 2: the first point of a problem without muscles.
pub(crate) fn without_muscles(plain: &GaitProgram, settings: &GuessSettings, cancel: &dyn Fn() -> bool) -> Vec<f64> {
    let postures = posture::solve(plain, settings, cancel);
    guessed_motion::guess(plain, &postures, settings)
}

/// Step 3: the first point of a problem with muscles, from a motion of the problem without them.
pub(crate) fn with_muscles(program: &GaitProgram, plain: &GaitProgram, motion: &[f64]) -> Vec<f64> {
    guessed_muscles::guess(program, plain, motion)
}
