//! Execution of a gait: walks under laboratory controllers, simulated by a model other than the optimiser's.
//!
//! The plant has a floating base, compliant ground under heel and toe of both feet, Coulomb friction, joint stops, and
//! drives with limited torque and torque rate (`plant`, `ground`, `actuator`). The prosthesis tracks the gait with what
//! it can measure (`prosthesis`, `sensors`); the human joints track it compliantly (`human_joints`). Both tell the time of the
//! stride from a phase variable (`stride_clock`). Gains and plant are the same for every gait.
//!
//! A simulated walk draws body mass, initial speed, push, delay, sensor noise and ground at random. The report says how
//! many walks end without a fall. It depends on the gait and the seed only, whatever the number of threads.

mod actuator;
mod control_period;
mod execution_report;
mod foot_contact;
mod gains;
mod ground;
mod human_joints;
mod planned_stride;
mod plant;
mod prosthesis;
mod random_disturbances;
mod random_stream;
mod report_sentence;
mod sensors;
mod simulated_walk;
mod stride_clock;
mod terrain;
mod undisturbed_walk;

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod simulation_tests;

pub use execution_report::{ExecutionReport, SimulatedWalksOnGround, SurvivedPushes};
pub use undisturbed_walk::StridesOnYield;

use crate::cancel_token::CancelToken;
use crate::gait::Gait;
use crate::model_error::ModelError;
use random_disturbances::{Disturbance, LADDER_N_S, MassChanges, Push};
use serde::{Deserialize, Serialize};
use simulated_walk::{SimulatedWalker, WalkEnd, WalkOutcome};
use std::sync::atomic::{AtomicU32, Ordering};

/// Version of the layout of [`ExecutionReport`] and of the simulation.
pub const FORMAT_VERSION: u32 = 2;
/// Strides before the push of the ladder, which comes in mid-stance of the prosthesis.
const STRIDES_BEFORE_PUSH: f64 = 3.2;

/// Options of [`simulate`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ExecutionOptions {
    /// Number of simulated walks on each kind of ground, 1 to [`Self::MAX_SIMULATED_WALKS`].
    pub number_of_simulated_walks: u32,
    /// Strides of a complete walk, 1 to 1000.
    pub strides: u32,
    /// Largest height and depth of the plateaus of each ground, m; 0 to [`Self::MAX_GROUND_M`].
    pub ground_heights_m: Vec<f64>,
    /// Seed of the disturbances.
    pub seed: u64,
    /// Number of threads, 1 to 64. The report does not depend on it.
    pub threads: usize,
}

impl Default for ExecutionOptions {
    fn default() -> Self {
        Self {
            number_of_simulated_walks: 50,
            strides: 20,
            ground_heights_m: vec![0.0, 0.005, 0.01],
            seed: 1,
            threads: 1,
        }
    }
}

impl ExecutionOptions {
    /// Largest number of simulated walks on a ground.
    pub const MAX_SIMULATED_WALKS: u32 = 100_000;
    /// Largest height and depth of the ground, m.
    pub const MAX_GROUND_M: f64 = 0.05;

    /// Number of walks with random disturbances, over all grounds.
    pub fn random_walks(&self) -> u32 {
        let grounds = u32::try_from(self.ground_heights_m.len()).unwrap_or(u32::MAX);
        self.number_of_simulated_walks.saturating_mul(grounds)
    }

    /// Checks each option.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        ModelError::check_range(
            "number_of_simulated_walks",
            f64::from(self.number_of_simulated_walks),
            1.0,
            f64::from(Self::MAX_SIMULATED_WALKS),
        )?;
        ModelError::check_range("strides", f64::from(self.strides), 1.0, 1e3)?;
        ModelError::check_range("threads", self.threads as f64, 1.0, 64.0)?;
        for height in &self.ground_heights_m {
            ModelError::check_range("ground_heights_m", *height, 0.0, Self::MAX_GROUND_M)?;
        }
        Ok(())
    }
}

/// Simulates walks with a gait. A walk takes some hundredths of a second. `done` counts those with random disturbances.
/// `None` if cancelled, within one walk.
///
/// # Errors
/// [`ModelError`] if the gait is malformed or an option is out of range.
pub fn simulate(
    gait: &Gait,
    options: &ExecutionOptions,
    done: &AtomicU32,
    cancel: &CancelToken,
) -> Result<Option<ExecutionReport>, ModelError> {
    options.validate()?;
    gait.validate()?;
    let gait_sha256 = gait.sha256()?;
    let walker = SimulatedWalker::new(gait)?;
    let strides = options.strides;
    let undisturbed = walker.walk(&Disturbance::none(), strides)?;
    let pushed_within_s = 0.5 * f64::from(strides) * walker.stride_s();
    let mass_changes = MassChanges::of(gait.subject.body_mass_kg);
    let walk = |ground_m: f64, number: u32| {
        let disturbance =
            Disturbance::random(options.seed, number, mass_changes, ground_m, walker.step_m(), pushed_within_s);
        let outcome = walker.walk(&disturbance, strides);
        done.fetch_add(1, Ordering::Relaxed);
        outcome
    };
    let mut grounds = Vec::new();
    for &ground_m in &options.ground_heights_m {
        let outcomes =
            in_parallel(options.number_of_simulated_walks, options.threads, cancel, &|number| walk(ground_m, number))?;
        if cancel.is_cancelled() {
            return Ok(None);
        }
        grounds.push(SimulatedWalksOnGround::of(ground_m, &outcomes));
    }
    let strides_by_yield = StridesOnYield::of(&walker, strides)?;
    let pushes = if undisturbed.end == WalkEnd::Completed { Some(survived_pushes(&walker, strides)?) } else { None };
    Ok(Some(ExecutionReport {
        format_version: FORMAT_VERSION,
        gait_sha256,
        seed: options.seed,
        strides,
        body_mass_kg: mass_changes.range_kg(gait.subject.body_mass_kg),
        undisturbed_strides: undisturbed.strides,
        grounds,
        strides_by_yield,
        pushes,
    }))
}

fn survived_pushes(walker: &SimulatedWalker<'_>, strides: u32) -> Result<SurvivedPushes, ModelError> {
    let largest = |direction: f64| {
        let mut survived = 0.0;
        for impulse in LADDER_N_S {
            let push = Push { start_s: STRIDES_BEFORE_PUSH * walker.stride_s(), impulse_n_s: direction * impulse };
            if walker.walk(&Disturbance::only(push), strides)?.end != WalkEnd::Completed {
                break;
            }
            survived = impulse;
        }
        Ok::<_, ModelError>(survived)
    };
    Ok(SurvivedPushes {
        forwards_n_s: largest(1.0)?,
        backwards_n_s: largest(-1.0)?,
        largest_tried_n_s: LADDER_N_S.into_iter().fold(0.0, f64::max),
    })
}

/// The walks 0 to `count`, in order; fewer if cancelled.
fn in_parallel(
    count: u32,
    threads: usize,
    cancel: &CancelToken,
    walk: &(dyn Fn(u32) -> Result<WalkOutcome, ModelError> + Sync),
) -> Result<Vec<WalkOutcome>, ModelError> {
    let next = AtomicU32::new(0);
    let worker = || {
        let mut done = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= count || cancel.is_cancelled() {
                return done;
            }
            done.push((number, walk(number)));
        }
    };
    let mut all = std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(worker)).collect();
        let mut all = worker();
        for other in others {
            match other.join() {
                Ok(done) => all.extend(done),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        all
    });
    all.sort_unstable_by_key(|(number, _)| *number);
    all.into_iter().map(|(_, outcome)| outcome).collect()
}
