//! The result of simulated walks.

use super::simulated_walk::{WalkEnd, WalkOutcome};
use super::undisturbed_walk::StridesOnYield;
use crate::statistics::wilson_interval;
use serde::{Deserialize, Serialize};

/// Simulated walks on one kind of ground.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulatedWalksOnGround {
    /// Largest height of bumps and depth of dips in the ground, m.
    pub ground_height_m: f64,
    /// Number of simulated walks.
    pub number_of_simulated_walks: u32,
    /// Walks that completed all strides.
    pub completed: u32,
    /// Walks that ended with a fall.
    pub fell: u32,
    /// Walks that ended with a halt: the walker took no further step.
    pub halted: u32,
    /// Share of completed walks.
    pub completed_share: f64,
    /// 95 % confidence interval of this share (Wilson).
    pub completed_share_interval: [f64; 2],
    /// Mean number of completed strides.
    pub mean_strides: f64,
    /// Share of the time in which the controller demanded more than the largest torque of the prosthetic knee.
    pub knee_saturated_share: f64,
    /// Share of the time in which the controller demanded more than the largest torque of the prosthetic ankle.
    pub ankle_saturated_share: f64,
    /// Share of the time in which the controller demanded a faster change of the knee torque than the actuator can
    /// make.
    pub knee_rate_limited_share: f64,
    /// Share of the time in which the controller demanded a faster change of the ankle torque than the actuator can
    /// make.
    pub ankle_rate_limited_share: f64,
}

/// The largest pushes of a fixed ladder that the walker survives, without other disturbances. It also survives every
/// smaller push of the ladder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurvivedPushes {
    /// Forwards, N s; 0 if it survives none.
    pub forwards_n_s: f64,
    /// Backwards, N s.
    pub backwards_n_s: f64,
    /// Largest push of the series, N s.
    pub largest_tried_n_s: f64,
}

/// The execution of a gait, simulated by a model other than the optimiser's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExecutionReport {
    /// Version of this layout and of the simulation.
    pub format_version: u32,
    /// SHA-256 of the gait as compact JSON, as in its certificate.
    pub gait_sha256: String,
    /// Seed of the disturbances.
    pub seed: u64,
    /// Strides of a complete simulated walk.
    pub strides: u32,
    /// Range from which the body masses of disturbed walks are drawn, kg: ±5 %, limited to the range of the model.
    pub body_mass_kg: [f64; 2],
    /// Completed strides without any disturbance.
    pub undisturbed_strides: u32,
    /// Randomly disturbed walks, for each kind of ground.
    pub grounds: Vec<SimulatedWalksOnGround>,
    /// Undisturbed walks on level ground, ordered from hard ground to soft ground. In all other walks the ground yields
    /// 0.01 m under body weight.
    pub strides_by_yield: Vec<StridesOnYield>,
    /// Pushes. `None` if the walker does not complete the undisturbed walk.
    pub pushes: Option<SurvivedPushes>,
}

impl ExecutionReport {
    /// Mean number of completed strides, over all randomly disturbed walks; 0 without any.
    pub fn mean_strides(&self) -> f64 {
        let strides: f64 =
            self.grounds.iter().map(|on| on.mean_strides * f64::from(on.number_of_simulated_walks)).sum();
        let walks: f64 = self.grounds.iter().map(|on| f64::from(on.number_of_simulated_walks)).sum();
        if walks > 0.0 { strides / walks } else { 0.0 }
    }

    /// Number of complete walks and of all walks, randomly disturbed.
    pub fn completed_of_all(&self) -> (u32, u32) {
        let sum = |count: fn(&SimulatedWalksOnGround) -> u32| self.grounds.iter().map(count).sum();
        (sum(|on| on.completed), sum(|on| on.number_of_simulated_walks))
    }
}

impl SimulatedWalksOnGround {
    pub(super) fn of(ground_height_m: f64, outcomes: &[WalkOutcome]) -> Self {
        let ended = |end: WalkEnd| u32::try_from(outcomes.iter().filter(|o| o.end == end).count()).unwrap_or(u32::MAX);
        let number_of_simulated_walks = u32::try_from(outcomes.len()).unwrap_or(u32::MAX);
        let periods = outcomes.iter().map(|o| o.periods).sum::<u64>().max(1);
        let share =
            |count: &dyn Fn(&WalkOutcome) -> u64| outcomes.iter().map(count).sum::<u64>() as f64 / periods as f64;
        let completed = ended(WalkEnd::Completed);
        let (low, high) = wilson_interval(completed, number_of_simulated_walks);
        Self {
            ground_height_m,
            number_of_simulated_walks,
            completed,
            fell: ended(WalkEnd::Fell),
            halted: ended(WalkEnd::Halted),
            completed_share: f64::from(completed) / f64::from(number_of_simulated_walks.max(1)),
            completed_share_interval: [low, high],
            mean_strides: outcomes.iter().map(|o| f64::from(o.strides)).sum::<f64>()
                / f64::from(number_of_simulated_walks.max(1)),
            knee_saturated_share: share(&|o| o.saturated[0]),
            ankle_saturated_share: share(&|o| o.saturated[1]),
            knee_rate_limited_share: share(&|o| o.rate_limited[0]),
            ankle_rate_limited_share: share(&|o| o.rate_limited[1]),
        }
    }
}
