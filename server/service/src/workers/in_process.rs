//! The engine of a single machine: one thread for each running solve.

use super::dispatch::{AssignmentResult, Dispatch, EngineMessage, Receipt};
use super::{Assignment, Evaluate};
use crate::dispatch_error::DispatchError;
use futures_util::future::BoxFuture;
use gait_optimizer::CancelToken;
use gaitwright_compute::priority::{SOLVER, STACK_BYTES, lower_priority};
use gaitwright_store::TrialId;
use std::any::Any;
use std::collections::HashMap;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::mpsc::{self, UnboundedReceiver, UnboundedSender};

/// Its name in the record.
pub const IN_PROCESS: &str = "in-process";
/// Longer than any iteration takes.
pub const LEASE: Duration = Duration::from_mins(1);

type Running = Arc<Mutex<HashMap<TrialId, (u32, CancelToken)>>>;

/// The solver threads of this process.
pub struct InProcess {
    evaluate: Arc<dyn Evaluate>,
    size: usize,
    lease: Duration,
    has_lower_priority: bool,
    running: Running,
    sender: UnboundedSender<EngineMessage>,
    messages: tokio::sync::Mutex<UnboundedReceiver<EngineMessage>>,
}

impl InProcess {
    /// An engine for at most `size` parallel solves (at least one).
    pub fn new(size: usize, evaluate: Arc<dyn Evaluate>) -> Self {
        let (sender, messages) = mpsc::unbounded_channel();
        Self {
            evaluate,
            size: size.max(1),
            lease: LEASE,
            has_lower_priority: false,
            running: Running::default(),
            sender,
            messages: tokio::sync::Mutex::new(messages),
        }
    }

    /// Lowers the priority of solves below that of requests.
    #[must_use]
    pub fn with_lower_priority(mut self) -> Self {
        self.has_lower_priority = true;
        self
    }

    /// Sets the time without an iteration after which a solve counts as lost.
    #[must_use]
    pub fn with_lease(mut self, lease: Duration) -> Self {
        self.lease = lease;
        self
    }

    /// Starts a solve on its own thread, unless the attempt is already running.
    fn begin(&self, assignment: Assignment) -> Result<(), DispatchError> {
        let attempt = assignment.attempt;
        let cancel = CancelToken::new();
        {
            let mut running = self.running();
            if running.get(&attempt.trial).is_some_and(|(number, _)| *number == attempt.number) {
                return Ok(());
            }
            if let Some((_, superseded)) = running.insert(attempt.trial, (attempt.number, cancel.clone())) {
                superseded.cancel();
            }
        }
        let (evaluate, sender, has_lower_priority) =
            (Arc::clone(&self.evaluate), self.sender.clone(), self.has_lower_priority);
        let running = Arc::clone(&self.running);
        let work = move || {
            if has_lower_priority {
                lower_priority(SOLVER);
            }
            // Fails only while the process is shutting down.
            let _ = sender.send(EngineMessage::Started { attempt, worker: IN_PROCESS.to_owned() });
            let result = solve(evaluate.as_ref(), &assignment, &sender, &cancel);
            let mut running = lock(&running);
            if running.get(&attempt.trial).is_some_and(|(number, _)| *number == attempt.number) {
                running.remove(&attempt.trial);
            }
            drop(running);
            let (worker, receipt) = (IN_PROCESS.to_owned(), Receipt::not_needed());
            let _ = sender.send(EngineMessage::Ended { attempt, worker, result, receipt });
        };
        let thread = std::thread::Builder::new().name("solver".to_owned()).stack_size(STACK_BYTES).spawn(work);
        thread.map(drop).map_err(|error| {
            self.running().remove(&attempt.trial);
            DispatchError::Unreachable(format!("Cannot start a thread for a solve: {error}."))
        })
    }

    fn running(&self) -> MutexGuard<'_, HashMap<TrialId, (u32, CancelToken)>> {
        lock(&self.running)
    }
}

impl Dispatch for InProcess {
    fn name(&self) -> &'static str {
        IN_PROCESS
    }

    fn size(&self) -> usize {
        self.size
    }

    fn lease(&self) -> Duration {
        self.lease
    }

    fn outlives_process(&self) -> bool {
        false
    }

    fn submit(&self, assignment: Assignment) -> BoxFuture<'_, Result<(), DispatchError>> {
        Box::pin(async move { self.begin(assignment) })
    }

    fn cancel(&self, trial: TrialId) -> BoxFuture<'_, ()> {
        Box::pin(async move {
            // A hanging thread keeps its memory, but does not block others.
            if let Some((_, cancel)) = self.running().remove(&trial) {
                cancel.cancel();
            }
        })
    }

    fn next(&self) -> BoxFuture<'_, EngineMessage> {
        Box::pin(async move {
            match self.messages.lock().await.recv().await {
                Some(message) => message,
                // Unreachable: the engine holds a sender itself.
                None => std::future::pending().await,
            }
        })
    }
}

impl Drop for InProcess {
    fn drop(&mut self) {
        for (_, cancel) in self.running().values() {
            cancel.cancel();
        }
    }
}

impl fmt::Debug for InProcess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("InProcess").field("size", &self.size).finish_non_exhaustive()
    }
}

fn solve(
    evaluate: &dyn Evaluate,
    assignment: &Assignment,
    sender: &UnboundedSender<EngineMessage>,
    cancel: &CancelToken,
) -> AssignmentResult {
    let attempt = assignment.attempt;
    let mut iterations = Vec::new();
    let found = catch_unwind(AssertUnwindSafe(|| {
        let mut observer = |record: &gait_optimizer::IterationRecord| {
            iterations.push(*record);
            let _ = sender.send(EngineMessage::Iterated { attempt, record: *record });
        };
        evaluate.evaluate(assignment, &mut observer, cancel)
    }));
    match found {
        Ok(Ok(outcome)) => AssignmentResult::Ended { outcome: Box::new(outcome), iterations },
        Ok(Err(reason)) => AssignmentResult::Broke(reason),
        Err(panic) => AssignmentResult::Broke(format!("The solver panicked: {}.", words_of(panic.as_ref()))),
    }
}

fn lock(running: &Running) -> MutexGuard<'_, HashMap<TrialId, (u32, CancelToken)>> {
    // The map is consistent between statements, so a poisoned lock is usable.
    running.lock().unwrap_or_else(PoisonError::into_inner)
}

fn words_of(panic: &(dyn Any + Send)) -> String {
    panic
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}
