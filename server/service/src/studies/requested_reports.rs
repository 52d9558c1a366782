//! Carries out the requests for execution reports of one study, for commands that run without the jobs of a service.

use super::execution::{self, NewExecutionReport};
use super::trial_jobs::run_cancellable;
use crate::error::Error;
use gait_optimizer::execution::{ExecutionOptions, simulate};
use gaitwright_compute::priority::SOLVER;
use gaitwright_store::{Store, StudyId, execution_reports, trials};
use std::sync::atomic::AtomicU32;
use tokio_util::sync::CancellationToken;

/// Makes every requested report of a study that is not on record, oldest request first. Calls `begins` with the number of
/// each trial. Dropping the future stops the simulation.
///
/// # Errors
/// [`Error::Conflict`] if the subject withdrew consent; a malformed gait; errors of the database.
pub async fn carry_out(store: &mut Store, study: StudyId, threads: usize, begins: impl Fn(u32)) -> Result<(), Error> {
    let requested = execution_reports::requested(&mut *store.read().await?).await?;
    for (id, number_of_simulated_walks, seed) in requested {
        let mut reader = store.read().await?;
        let trial = trials::get(&mut reader, id).await?;
        if trial.study_id != study {
            continue;
        }
        let gait = execution::gait_of(&mut reader, id).await?;
        drop(reader);
        begins(trial.number);
        let asked = NewExecutionReport { number_of_simulated_walks, seed };
        let options = ExecutionOptions { threads, ..asked.options()? };
        let gait = store.compute(move |pool| gait.unpack(pool)).await??;
        let work = move |cancel: &_| simulate(&gait, &options, &AtomicU32::new(0), cancel);
        if let Some(report) = run_cancellable(("walk simulator", SOLVER), &CancellationToken::new(), work).await?? {
            execution::record(store, id, asked, report).await?;
        }
    }
    Ok(())
}
