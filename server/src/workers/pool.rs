//! The in-process pool: one named thread per running solve, at most so many at a time.

use super::{Assignment, Board, Evaluate};
use crate::store::TrialId;
use gait_optimizer::{CancelToken, IterationRecord, SolveOutcome};
use std::any::Any;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};

/// Stack of a solver thread: block factorisations recurse deeper than the default leaves room for.
const STACK_BYTES: usize = 16 << 20;

/// What came of an assignment.
#[derive(Debug)]
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

/// The right to run one solve.
#[derive(Debug)]
pub struct Slot(OwnedSemaphorePermit);

/// Threads that solve.
pub struct Pool {
    evaluate: Arc<dyn Evaluate>,
    slots: Arc<Semaphore>,
    size: usize,
    running: Mutex<HashMap<TrialId, CancelToken>>,
    board: Arc<Board>,
}

impl Pool {
    /// A pool of `size` slots (at least one).
    pub fn new(size: usize, evaluate: Arc<dyn Evaluate>, board: Arc<Board>) -> Self {
        let size = size.max(1);
        Self { evaluate, slots: Arc::new(Semaphore::new(size)), size, running: Mutex::default(), board }
    }

    /// How many solves can run at the same time.
    pub fn size(&self) -> usize {
        self.size
    }

    /// A free slot, if there is one.
    pub fn try_slot(&self) -> Option<Slot> {
        Arc::clone(&self.slots).try_acquire_owned().ok().map(Slot)
    }

    /// Runs an assignment on a thread of its own. The slot is free again when the thread ends.
    pub fn run(&self, slot: Slot, assignment: Assignment) -> oneshot::Receiver<Finding> {
        let (answer, finding) = oneshot::channel();
        let cancel = CancelToken::new();
        let trial = assignment.trial;
        self.running().insert(trial, cancel.clone());
        self.board.open(trial, assignment.study, assignment.number);
        let (evaluate, board) = (Arc::clone(&self.evaluate), Arc::clone(&self.board));
        let work = move || {
            let slot = slot.0;
            let found = catch_unwind(AssertUnwindSafe(|| {
                evaluate.evaluate(&assignment, &mut |record| board.add(trial, *record), &cancel)
            }));
            let iterations = board.close(trial);
            let finding = match found {
                Ok(Ok(outcome)) => Finding::Ended { outcome: Box::new(outcome), iterations },
                Ok(Err(reason)) => Finding::Broke(reason),
                Err(panic) => Finding::Broke(format!("the solver panicked: {}", words_of(panic.as_ref()))),
            };
            drop(slot);
            // Nobody waits any more when the process is shutting down.
            let _ = answer.send(finding);
        };
        let thread = std::thread::Builder::new().name("solver".to_owned()).stack_size(STACK_BYTES).spawn(work);
        if let Err(error) = thread {
            // The closure was dropped, and with it the sender: the receiver reports a closed channel.
            tracing::error!(%error, "no thread for a solve");
            self.board.close(trial);
        }
        finding
    }

    /// Forgets a trial whose finding was taken.
    pub fn release(&self, trial: TrialId) {
        self.running().remove(&trial);
    }

    /// Asks the solve of a trial to stop within one iteration. `false`: it does not run here.
    pub fn cancel(&self, trial: TrialId) -> bool {
        self.running().get(&trial).map(CancelToken::cancel).is_some()
    }

    /// Asks every solve to stop.
    pub fn cancel_all(&self) {
        for token in self.running().values() {
            token.cancel();
        }
    }

    /// The board its solves report on.
    pub fn board(&self) -> &Arc<Board> {
        &self.board
    }

    fn running(&self) -> MutexGuard<'_, HashMap<TrialId, CancelToken>> {
        // The map is whole between any two statements that hold the lock.
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for Pool {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pool").field("size", &self.size).finish_non_exhaustive()
    }
}

fn words_of(panic: &(dyn Any + Send)) -> String {
    panic
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}
