//! The seam between the record and whatever runs solves: threads of this process, or workers on other machines.
//!
//! An engine may forget everything at any time, bring a result late, or bring it twice. What counts is decided in the
//! record, by the number of the attempt.

use super::Assignment;
use futures_util::future::BoxFuture;
use gait_optimizer::{IterationRecord, SolveOutcome};
use gaitwright_store::TrialId;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::time::Duration;
use thiserror::Error;

/// One try at the solve of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Attempt {
    /// The trial.
    pub trial: TrialId,
    /// 1, 2, ...: a result counts only while this is the newest try.
    pub number: u32,
}

/// What came of an assignment.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum Finding {
    /// The solve ended by itself, with or without a gait.
    Ended {
        /// What it gave.
        outcome: Box<SolveOutcome>,
        /// Its iterations.
        iterations: Vec<IterationRecord>,
    },
    /// The program failed: a panic or an error, in words.
    Broke(String),
}

/// What is heard of a job that was submitted.
#[derive(Debug)]
pub enum News {
    /// A worker took it.
    Started {
        /// Which try.
        attempt: Attempt,
        /// Who runs it.
        worker: String,
    },
    /// Its solve came one iteration further: also the sign that the worker lives.
    Iterated {
        /// Which try.
        attempt: Attempt,
        /// The iteration.
        record: IterationRecord,
    },
    /// It came to an end.
    Ended {
        /// Which try.
        attempt: Attempt,
        /// Who ran it.
        worker: String,
        /// What came of it.
        finding: Finding,
        /// To be signed once the finding is in the record; unsigned, it may be brought again.
        receipt: Receipt,
    },
}

/// Tells the engine that what it brought is in the record.
pub struct Receipt(Option<BoxFuture<'static, ()>>);

impl Receipt {
    /// Of an engine that does not ask for one.
    pub fn not_needed() -> Self {
        Self(None)
    }

    /// What to do when it is signed.
    pub fn new(sign: impl Future<Output = ()> + Send + 'static) -> Self {
        Self(Some(Box::pin(sign)))
    }

    /// Signs it.
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

/// A job could not be handed over; it is tried again later.
#[derive(Debug, Error)]
pub enum DispatchError {
    /// The job is too large for the engine.
    #[error("{what} of {bytes} bytes is more than the {limit} bytes that the broker takes: raise its max_payload")]
    TooLarge {
        /// What was to be sent.
        what: &'static str,
        /// Its size.
        bytes: usize,
        /// What the broker takes.
        limit: usize,
    },
    /// A message cannot be written or read.
    #[error("a message between service and worker: {0}")]
    Message(String),
    /// The engine cannot be reached.
    #[error("{0}")]
    Unreachable(String),
}

/// What takes jobs and tells what comes of them.
pub trait Dispatch: Send + Sync + 'static {
    /// Its name in the record.
    fn name(&self) -> &'static str;

    /// How many jobs may be out at the same time.
    fn size(&self) -> usize;

    /// A worker that is silent for so long has lost its job.
    fn lease(&self) -> Duration;

    /// Whether jobs that were submitted go on when this process ends.
    fn outlives_process(&self) -> bool;

    /// Why it cannot work now, in words; none: it can.
    fn trouble(&self) -> Option<String> {
        None
    }

    /// Hands a job over. Handing the same attempt over twice has the effect of once.
    fn submit(&self, assignment: Assignment) -> BoxFuture<'_, Result<(), DispatchError>>;

    /// Asks that the solve of a trial stop within one iteration; nobody waits for it any more.
    fn withdraw(&self, trial: TrialId) -> BoxFuture<'_, ()>;

    /// The next news. Dropping the future loses none.
    fn next(&self) -> BoxFuture<'_, News>;
}
