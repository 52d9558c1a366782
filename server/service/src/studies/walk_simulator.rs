//! Background task that simulates walks with the gaits of trials, on request.
//!
//! It simulates the walks of one gait at a time, at lower priority than solves. The audit trail holds the requests, so
//! the task continues after a crash.

use super::execution::{self, Simulation, WalksAsked};
use super::job::JobState;
use crate::error::Error;
use gait_optimizer::CancelToken;
use gait_optimizer::execution::simulate;
use gaitwright_compute::priority::behind_solves;
use gaitwright_store::{Store, StoreResult, TrialId, execution_reports};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::{Notify, watch};

/// Simulates the walks of one gait at a time.
pub(super) struct WalkSimulator {
    store: Store,
    state: Mutex<State>,
    asked: Notify,
}

#[derive(Debug, Default)]
struct State {
    /// Requests in order, without the running one.
    queued: VecDeque<(TrialId, WalksAsked)>,
    running: Option<Running>,
    /// What somebody cancelled, until somebody asks for it again.
    cancelled: BTreeSet<TrialId>,
    /// Why the last simulation of a gait failed.
    failed: BTreeMap<TrialId, String>,
}

#[derive(Debug, Clone)]
struct Running {
    trial: TrialId,
    asked: WalksAsked,
    done: Arc<AtomicU32>,
    /// Number of walks over all grounds.
    walks: u32,
    cancel: CancelToken,
}

/// Ends the simulation when the task stops waiting.
struct CancelOnDrop(CancelToken);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

impl WalkSimulator {
    /// Creates the task; [`Self::run`] starts it.
    pub(super) fn new(store: Store) -> Self {
        Self { store, state: Mutex::default(), asked: Notify::new() }
    }

    /// Queues a request, unless one for the same gait is queued or running; `None` if the report exists already.
    pub(super) fn ask_for(&self, trial: TrialId, asked: Option<WalksAsked>) {
        let mut state = self.state();
        state.cancelled.remove(&trial);
        state.failed.remove(&trial);
        if let (Some(asked), None) = (asked, state.open(trial)) {
            state.queued.push_back((trial, asked));
            self.asked.notify_one();
        }
    }

    /// The state of the report of a gait.
    pub(super) fn state_of(&self, trial: TrialId) -> Simulation {
        let state = self.state();
        if let Some(running) = state.running.as_ref().filter(|running| running.trial == trial) {
            let done = running.done.load(Ordering::Relaxed);
            return Simulation::Running { asked: running.asked, done, walks: running.walks };
        }
        if let Some(asked) = state.open(trial) {
            return Simulation::Queued(asked);
        }
        match state.failed.get(&trial) {
            Some(reason) => Simulation::Failed(reason.clone()),
            None if state.cancelled.contains(&trial) => Simulation::Cancelled,
            None => Simulation::None,
        }
    }

    /// The gaits whose reports are queued or running, each with the state of its job.
    pub(super) fn jobs(&self) -> Vec<(TrialId, JobState)> {
        let state = self.state();
        let running = state.running.iter().map(|running| (running.trial, JobState::Running));
        running.chain(state.queued.iter().map(|(trial, _)| (*trial, JobState::Queued))).collect()
    }

    /// Gives up a report until somebody asks for it again.
    pub(super) fn cancel(&self, trial: TrialId) {
        let mut state = self.state();
        state.queued.retain(|(queued, _)| *queued != trial);
        state.cancelled.insert(trial);
        if let Some(running) = state.running.take_if(|running| running.trial == trial) {
            running.cancel.cancel();
        }
    }

    /// Runs forever. `pulse` changes with every change of the record. Calls `changed` after it stored a report.
    pub(super) async fn run(&self, mut pulse: watch::Receiver<u64>, changed: impl Fn()) {
        let mut recalled = false;
        loop {
            if !recalled {
                match self.recall().await {
                    Ok(()) => recalled = true,
                    Err(error) => tracing::error!(%error, "cannot read which execution reports were requested"),
                }
            }
            let Some(running) = self.next() else {
                tokio::select! {
                    () = self.asked.notified() => {}
                    _ = pulse.changed() => {}
                }
                continue;
            };
            let result = self.simulate(&running).await;
            let mut state = self.state();
            // Cancelling has removed it already.
            state.running.take_if(|other| other.trial == running.trial);
            match result {
                Ok(()) => {}
                // The subject withdrew consent, or the gait was pruned, in the meantime.
                Err(error @ (Error::Conflict(_) | Error::NotFound { .. })) => {
                    tracing::info!(trial = %running.trial, %error, "no walks are simulated");
                }
                Err(error) => {
                    tracing::error!(trial = %running.trial, %error, "cannot simulate walks");
                    state.failed.insert(running.trial, error.to_string());
                }
            }
            drop(state);
            changed();
        }
    }

    /// Queues what was requested before this process started.
    async fn recall(&self) -> StoreResult<()> {
        let requested = execution_reports::requested(&mut *self.store.read().await?).await?;
        let mut state = self.state();
        for (trial, walks, seed) in requested {
            if state.open(trial).is_none() {
                state.queued.push_back((trial, WalksAsked { walks, seed }));
            }
        }
        Ok(())
    }

    /// The next request, which is running from now on.
    fn next(&self) -> Option<Running> {
        let mut state = self.state();
        let (trial, asked) = state.queued.pop_front()?;
        let walks = asked.options().map_or(0, |options| options.random_walks());
        let running = Running { trial, asked, done: Arc::default(), walks, cancel: CancelToken::new() };
        state.running = Some(running.clone());
        Some(running)
    }

    /// Simulates the walks of a request and stores the report. Dropping the future ends the simulation within one walk.
    async fn simulate(&self, running: &Running) -> Result<(), Error> {
        let Running { trial, asked, done, cancel, .. } = running.clone();
        let options = asked.options()?;
        let mut store = self.store.clone();
        let gait = execution::gait_of(&mut *store.read().await?, trial).await?;
        let gait = store.compute(move |pool| gait.unpack(pool)).await??;
        let (_cancels, of_thread) = (CancelOnDrop(cancel.clone()), cancel.clone());
        let told = behind_solves("walk simulator", move || simulate(&gait, &options, &done, &of_thread))
            .map_err(|e| Error::Internal(format!("cannot start a thread for a simulation: {e}")))?;
        let report = told.await.map_err(|_| Error::Internal("the simulation panicked".to_owned()))??;
        match report {
            Some(report) => execution::record(&self.store, trial, asked, report, &cancel).await,
            None => Ok(()),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // The state is whole between any two statements that hold the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// The request for a gait that is queued or running.
    fn open(&self, trial: TrialId) -> Option<WalksAsked> {
        let running = self.running.as_ref().filter(|running| running.trial == trial).map(|running| running.asked);
        running.or_else(|| self.queued.iter().find(|(queued, _)| *queued == trial).map(|(_, asked)| *asked))
    }
}

impl fmt::Debug for WalkSimulator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("WalkSimulator").field("state", &self.state).finish_non_exhaustive()
    }
}
