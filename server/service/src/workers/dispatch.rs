//! The interface between the scheduler and the engines that run solves: threads of this process, or workers on other
//! machines.
//!
//! An engine may lose jobs, and may deliver a result late or twice. The record decides what counts, by the number of
//! the attempt.

use crate::dispatch_error::DispatchError;
use futures_util::future::BoxFuture;
use gait_optimizer::{GaitProblem, IterationRecord, SolveOptions, SolveOutcome, WarmStart};
use gaitwright_store::TrialId;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::time::Duration;

/// One attempt at the solve of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Attempt {
    /// The trial.
    pub trial: TrialId,
    /// Number of the attempt, from 1. A result counts only if this is the newest attempt.
    pub number: u32,
}

/// One solve to run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Assignment {
    /// The trial and the number of the attempt.
    pub attempt: Attempt,
    /// Number of the trial within its study.
    pub number: u32,
    /// The gait problem.
    pub problem: GaitProblem,
    /// The warm start; `None` for a cold start.
    pub warm_start: Option<WarmStart>,
    /// Settings and limits of the solver.
    pub options: SolveOptions,
}

/// The result of an assignment.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum AssignmentResult {
    /// The solve ended by itself, with or without a gait.
    Ended {
        /// The outcome.
        outcome: Box<SolveOutcome>,
        /// Its iterations.
        iterations: Vec<IterationRecord>,
    },
    /// The program failed with this panic or error message.
    Broke(String),
}

/// A message about a submitted job.
#[derive(Debug)]
pub enum EngineMessage {
    /// A worker started the job.
    Started {
        /// The attempt.
        attempt: Attempt,
        /// Name of the worker.
        worker: String,
    },
    /// The solve completed an iteration, which also renews the lease.
    Iterated {
        /// The attempt.
        attempt: Attempt,
        /// The iteration.
        record: IterationRecord,
    },
    /// The job ended.
    Ended {
        /// The attempt.
        attempt: Attempt,
        /// Name of the worker.
        worker: String,
        /// The result.
        result: AssignmentResult,
        /// Must be signed once the result is on record. Otherwise the engine may deliver it again.
        receipt: Receipt,
    },
}

/// Acknowledges to the engine that a result is on record.
pub struct Receipt(Option<BoxFuture<'static, ()>>);

impl Receipt {
    /// A receipt for an engine that needs none.
    pub fn not_needed() -> Self {
        Self(None)
    }

    /// A receipt with the action that acknowledges it.
    pub fn new(sign: impl Future<Output = ()> + Send + 'static) -> Self {
        Self(Some(Box::pin(sign)))
    }

    /// Acknowledges the result.
    pub async fn sign(self) {
        if let Some(sign) = self.0 {
            sign.await;
        }
    }
}

impl fmt::Debug for Receipt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Receipt").field(&self.0.is_some()).finish()
    }
}

/// An engine that runs jobs and reports their results.
pub trait Dispatch: Send + Sync + 'static {
    /// Its name in the record.
    fn name(&self) -> &'static str;

    /// Maximum number of dispatched jobs.
    fn size(&self) -> usize;

    /// Time without a message after which a worker loses its job.
    fn lease(&self) -> Duration;

    /// Whether submitted jobs survive the end of this process.
    fn outlives_process(&self) -> bool;

    /// Why the engine cannot work now, if it cannot.
    fn problem(&self) -> Option<String> {
        None
    }

    /// Number of storages that the engine has had since this process started. Jobs that were submitted before the newest
    /// one may be lost.
    fn storages(&self) -> u64 {
        0
    }

    /// Submits a job. Submitting the same attempt twice has no further effect.
    fn submit(&self, assignment: Assignment) -> BoxFuture<'_, Result<(), DispatchError>>;

    /// Cancels the solve of a trial, which stops within one iteration.
    fn cancel(&self, trial: TrialId) -> BoxFuture<'_, ()>;

    /// The next message. Dropping the future loses none.
    fn next(&self) -> BoxFuture<'_, EngineMessage>;
}
