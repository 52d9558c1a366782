//! The execution report of one trial's gait: what it is of, its state, and its storage.

use super::seed::MAX_SEED;
use super::trial_transitions::has_state;
use crate::error::Error;
use gait_optimizer::Gait;
use gait_optimizer::execution::{ExecutionOptions, ExecutionReport};
use gaitwright_store::audit::{self, Actor};
pub use gaitwright_store::execution_reports::newest;
use gaitwright_store::execution_reports::{self, ExecutionReported};
use gaitwright_store::trials::Trial;
use gaitwright_store::{
    Connection, Packed, Store, StoreResult, TrialId, Writer, commit, consents, events, gaits, trials,
};
use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

/// Largest number of simulated walks on a ground: some minutes of processor time.
pub const MAX_SIMULATED_WALKS: u32 = 1000;

/// A request to simulate walks. There are three kinds of ground: level, and uneven by ±5 mm or ±10 mm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
#[schema(as = NewExecutionReport)]
pub struct NewExecutionReport {
    /// Number of simulated walks on each kind of ground, 1 to 1000.
    #[schema(minimum = 1, maximum = 1000)]
    pub number_of_simulated_walks: u32,
    /// Seed of the disturbances. The same seed gives the same report.
    pub seed: u64,
}

impl Default for NewExecutionReport {
    fn default() -> Self {
        let ExecutionOptions { number_of_simulated_walks, seed, .. } = ExecutionOptions::default();
        Self { number_of_simulated_walks, seed }
    }
}

impl NewExecutionReport {
    /// The options of the simulation.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub fn options(self) -> Result<ExecutionOptions, Error> {
        let Self { number_of_simulated_walks, seed } = self;
        if !(1..=MAX_SIMULATED_WALKS).contains(&number_of_simulated_walks) {
            return Err(Error::invalid(
                "number_of_simulated_walks",
                number_of_simulated_walks,
                &format!("1 to {MAX_SIMULATED_WALKS}"),
            ));
        }
        if seed > MAX_SEED {
            return Err(Error::invalid("seed", seed, &format!("0 to {MAX_SEED}")));
        }
        Ok(ExecutionOptions { number_of_simulated_walks, seed, ..ExecutionOptions::default() })
    }
}

/// The state of the execution report of a gait in this process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Simulation {
    /// This process has no request for it and no outcome.
    None,
    /// Queued.
    Queued(NewExecutionReport),
    /// The simulation is running.
    Running {
        /// The request.
        asked: NewExecutionReport,
        /// Number of simulated walks so far.
        done: u32,
        /// Number of simulated walks, over all grounds.
        of: u32,
    },
    /// Somebody cancelled it.
    Cancelled,
    /// The simulation failed, for this reason.
    Failed(String),
}

impl Simulation {
    /// The request that is queued or running.
    pub fn open(&self) -> Option<NewExecutionReport> {
        match self {
            Self::Queued(asked) | Self::Running { asked, .. } => Some(*asked),
            Self::None | Self::Cancelled | Self::Failed(_) => None,
        }
    }
}

/// The gait of a trial to walk with.
///
/// # Errors
/// [`Error::Conflict`] if the trial has no converged gait, a script evaluated it, or the subject withdrew consent;
/// [`Error::NotFound`] if the gait was pruned; errors of the database.
pub(super) async fn gait_of(db: &mut Connection, id: TrialId) -> Result<Packed<Gait>, Error> {
    let trial = trials::get(db, id).await?;
    consents::may_be_shown(db, trial.study_id).await?;
    match why_not(&trial) {
        Some(reason) => Err(Error::conflict(reason)),
        None => Ok(gaits::get(db, id).await?),
    }
}

/// Why no walk with the gait of a trial can be simulated.
fn why_not(trial: &Trial) -> Option<String> {
    let number = trial.number;
    if !trial.state.has_gait() {
        let state = has_state(trial.state);
        return Some(format!("Trial {number} {state}. Walks can be simulated only with a converged gait."));
    }
    let by_script = format!(
        "Trial {number} was evaluated by a script, so its gait is not stored here and walks cannot be simulated."
    );
    trial.script.is_some().then_some(by_script)
}

/// Stores a requested report.
///
/// # Errors
/// [`Error::Conflict`] if the subject withdrew consent; errors of the database.
pub(super) async fn record(
    store: &Store,
    id: TrialId,
    asked: NewExecutionReport,
    report: ExecutionReport,
) -> Result<(), Error> {
    let mut writer = store.write().await?;
    let trial = trials::get(&mut writer, id).await?;
    consents::may_be_shown(&mut writer, trial.study_id).await?;
    write(&mut writer, &trial, asked, report).await?;
    Ok(commit(writer).await?)
}

/// Writes a report, within the change of the caller.
///
/// # Errors
/// Errors of the database.
pub(super) async fn write(
    writer: &mut Writer,
    trial: &Trial,
    asked: NewExecutionReport,
    report: ExecutionReport,
) -> StoreResult<()> {
    let (id, NewExecutionReport { number_of_simulated_walks, seed }) = (trial.id, asked);
    let actor = Actor::program();
    let program = actor.as_str().to_owned();
    let reported =
        ExecutionReported { trial_id: id, number: trial.number, number_of_simulated_walks, seed, program, report };
    events::append(writer, trial.study_id, execution_reports::REPORTED, &reported).await?;
    audit::append(writer, &actor, execution_reports::STORED, &format!("trial {id}"), &json!(asked)).await
}

/// Records a request, so that it outlives the process.
///
/// # Errors
/// Errors of the database.
pub(super) async fn request(
    writer: &mut Writer,
    actor: &Actor,
    id: TrialId,
    asked: NewExecutionReport,
) -> StoreResult<()> {
    audit::append(writer, actor, execution_reports::REQUESTED, &format!("trial {id}"), &json!(asked)).await
}
