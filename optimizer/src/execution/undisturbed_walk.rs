//! The undisturbed walk on harder and softer ground.

use super::ground::YIELD_M;
use super::random_disturbances::Disturbance;
use super::simulated_walk::SimulatedWalker;
use crate::model_error::ModelError;
use serde::{Deserialize, Serialize};

/// Depths of the ground under body weight, m, from hard to soft; one is [`YIELD_M`].
const YIELD_LADDER_M: [f64; 5] = [0.001, 0.002, 0.005, YIELD_M, 0.02];

/// An undisturbed walk on ground of some stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StridesOnYield {
    /// How far the ground yields under body weight, m.
    pub yield_m: f64,
    /// Completed strides.
    pub strides: u32,
}

impl StridesOnYield {
    /// The walks on each ground of the ladder.
    pub(super) fn of(walker: &SimulatedWalker<'_>, strides: u32) -> Result<Vec<Self>, ModelError> {
        let on_ground = |yield_m| {
            let outcome = walker.walk(&Disturbance { yield_m, ..Disturbance::none() }, strides)?;
            Ok(Self { yield_m, strides: outcome.strides })
        };
        YIELD_LADDER_M.into_iter().map(on_ground).collect()
    }
}
