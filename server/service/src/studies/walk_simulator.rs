//! The job that simulates walks with the gait of a trial, on request.

use super::execution::{self, NewExecutionReport, Simulation};
use super::job_queue::TrialJobState;
use super::trial_jobs::{TrialJob, run_cancellable};
use crate::error::Error;
use gait_optimizer::execution::simulate;
use gaitwright_compute::priority::BACKGROUND_NICENESS;
use gaitwright_store::{Store, StoreResult, TrialId, cancelled_jobs, execution_reports};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use tokio_util::sync::CancellationToken;

/// Simulates the walks of one gait.
pub(super) struct WalkSimulator {
    store: Store,
}

/// A request, and how much of it is done.
#[derive(Debug, Clone)]
pub(super) struct Request {
    asked: NewExecutionReport,
    /// Number of simulated walks so far.
    done: Arc<AtomicU32>,
}

impl From<NewExecutionReport> for Request {
    fn from(asked: NewExecutionReport) -> Self {
        Self { asked, done: Arc::default() }
    }
}

impl WalkSimulator {
    /// For the gaits of a record.
    pub(super) fn new(store: Store) -> Self {
        Self { store }
    }
}

impl TrialJob for WalkSimulator {
    const NAME: &'static str = "execution report";
    type Request = Request;

    async fn requested(&self) -> StoreResult<Vec<(TrialId, Request)>> {
        let requested = execution_reports::requested(&mut *self.store.read().await?).await?;
        Ok(requested
            .into_iter()
            .map(|(trial, number_of_simulated_walks, seed)| {
                (trial, NewExecutionReport { number_of_simulated_walks, seed }.into())
            })
            .collect())
    }

    async fn cancelled(&self) -> StoreResult<Vec<TrialId>> {
        cancelled_jobs::trials(&mut *self.store.read().await?, "execution_report", execution_reports::REQUESTED).await
    }

    /// The simulation ends within one walk after the future was dropped.
    async fn carry_out(
        &self,
        trial: TrialId,
        Request { asked, done }: Request,
        cancelled: CancellationToken,
    ) -> Result<(), Error> {
        let options = asked.options()?;
        let mut store = self.store.clone();
        let gait = execution::gait_of(&mut *store.read().await?, trial).await?;
        let gait = store.compute(move |pool| gait.unpack(pool)).await??;
        let work = move |cancel: &_| simulate(&gait, &options, &done, cancel);
        match run_cancellable(("walk simulator", BACKGROUND_NICENESS), &cancelled, work).await?? {
            Some(report) => execution::record(&self.store, trial, asked, report).await,
            None => Ok(()),
        }
    }
}

/// The state of the execution report of a gait.
pub(super) fn simulation(state: TrialJobState<Request>) -> Simulation {
    match state {
        TrialJobState::None => Simulation::None,
        TrialJobState::Queued(Request { asked, .. }) => Simulation::Queued(asked),
        TrialJobState::Running { request: Request { asked, done }, .. } => Simulation::Running {
            asked,
            done: done.load(Ordering::Relaxed),
            of: asked.options().map_or(0, |options| options.random_walks()),
        },
        TrialJobState::Cancelled => Simulation::Cancelled,
        TrialJobState::Failed(reason) => Simulation::Failed(reason),
    }
}
