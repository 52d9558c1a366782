//! An engine without workers: it accepts jobs and starts none.

use futures_util::future::BoxFuture;
use gaitwright_service::dispatch_error::DispatchError;
use gaitwright_service::workers::{Assignment, Attempt, Dispatch, EngineMessage};
use gaitwright_store::TrialId;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The engine.
#[derive(Debug, Clone, Default)]
pub struct Away {
    /// How many jobs it takes.
    pub size: usize,
    /// The accepted jobs, in order of arrival.
    pub jobs: Arc<Mutex<Vec<Attempt>>>,
}

impl Dispatch for Away {
    fn name(&self) -> &'static str {
        "away"
    }

    fn size(&self) -> usize {
        self.size
    }

    fn lease(&self) -> Duration {
        Duration::from_mins(1)
    }

    fn outlives_process(&self) -> bool {
        true
    }

    fn submit(&self, assignment: Assignment) -> BoxFuture<'_, Result<(), DispatchError>> {
        Box::pin(async move {
            self.jobs.lock().unwrap().push(assignment.attempt);
            Ok(())
        })
    }

    fn cancel(&self, trial: TrialId) -> BoxFuture<'_, ()> {
        Box::pin(async move { self.jobs.lock().unwrap().retain(|attempt| attempt.trial != trial) })
    }

    fn next(&self) -> BoxFuture<'_, EngineMessage> {
        Box::pin(std::future::pending())
    }
}
