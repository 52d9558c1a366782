//! Earlier solves on record: the result of the same input is taken from there, in whichever study it was found.
//!
//! The same input has the same outcome, bit for bit, so this only shortens the wait.

use super::super::problem_file::{PackedInput, SolveInput};
use super::Scheduler;
use crate::error::Error;
use crate::workers::{Assignment, AssignmentResult};
use gait_optimizer::SolveOutcome;
use gaitwright_compute::OnPool;
use gaitwright_store::{StoreError, TrialId, gaits, other_local_optima, solve_inputs, trials};

/// The worker name of these results in the record.
pub(super) const EARLIER: &str = "earlier solve";

impl Scheduler {
    /// The trial with the result of the same input, if the record has its gait.
    pub(super) async fn earlier_solve(&self, assignment: &Assignment) -> Result<Option<TrialId>, Error> {
        let mut store = self.0.unpacking.clone();
        let Assignment { problem, options, warm_start, .. } = assignment.clone();
        let hash = move |_: &OnPool| SolveInput { problem, options, warm_start }.sha256();
        let sha256 = store.compute(hash).await??;
        Ok(solve_inputs::solved(&mut *store.read().await?, &sha256).await?)
    }

    /// The result of an earlier solve. `None` if it cannot be read: then the trial is solved.
    pub(super) async fn result_of(&self, earlier: TrialId) -> Result<Option<AssignmentResult>, Error> {
        let mut store = self.0.unpacking.clone();
        let mut reader = store.read().await?;
        let trial = trials::get(&mut reader, earlier).await?;
        let Some(report) = trial.report else { return Ok(None) };
        let gait = gaits::get(&mut reader, earlier).await?;
        let warm_start = gaits::warm_start(&mut reader, earlier).await?;
        let iterations = gaits::iterations(&mut reader, earlier).await?;
        let others = other_local_optima::of_trial(&mut reader, earlier).await?;
        drop(reader);
        let violations = trial.violations;
        let unpack = move |pool: &OnPool| {
            let (gait, warm_start) = (gait.unpack(pool)?, warm_start.unpack(pool)?);
            let others = others.into_iter().map(|stored| stored.unpack(pool)).collect::<Result<_, _>>()?;
            let outcome = SolveOutcome { report, gait, warm_start, violations, other_local_optima: others };
            Ok::<_, StoreError>(AssignmentResult::Ended {
                outcome: outcome.into(),
                iterations: iterations.unpack(pool)?,
            })
        };
        match store.compute(unpack).await? {
            Ok(result) => Ok(Some(result)),
            Err(error) => {
                tracing::error!(trial = %earlier, %error, "cannot read an earlier solve");
                Ok(None)
            }
        }
    }

    /// The hash of the input of a trial's solve. `None` if the gait of its warm start was deleted.
    pub(super) async fn input_sha256(&self, trial: TrialId) -> Result<Option<String>, Error> {
        let mut store = self.0.unpacking.clone();
        let mut reader = store.read().await?;
        let input = match PackedInput::of_trial(&mut reader, trial).await {
            Ok(input) => input,
            Err(Error::NotFound { .. }) => return Ok(None),
            Err(error) => return Err(error),
        };
        drop(reader);
        store.compute(move |pool| input.unpack(pool)?.sha256()).await?.map(Some)
    }
}
