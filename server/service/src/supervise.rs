//! Supervision of background tasks: restarts a task that fails or panics, after growing pauses. The service is not
//! ready while a task is down or fails often.

use crate::error::Error;
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::task::JoinError;
use tokio_util::sync::CancellationToken;
use tokio_util::task::AbortOnDropHandle;

/// Pause before the first restart. It doubles with each failure that follows soon.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
/// Longest of these pauses.
const MAX_PAUSE: Duration = Duration::from_secs(10);
/// Number of failures within [`FAILURE_WINDOW`] from which a running task is reported too.
const FAILURE_LIMIT: usize = 5;
/// The time window of [`FAILURE_LIMIT`].
const FAILURE_WINDOW: Duration = Duration::from_mins(1);

/// The states of the background tasks.
#[derive(Debug, Clone, Default)]
pub struct Tasks(Arc<Mutex<BTreeMap<&'static str, TaskState>>>);

#[derive(Debug, Default)]
struct TaskState {
    /// Why the task is down; `None` while it runs.
    down: Option<String>,
    /// Times of the last failures, and the reason of the newest.
    failures: VecDeque<Instant>,
    reason: String,
}

/// A handle with which a running task reports that it works.
#[derive(Debug, Clone)]
pub struct Task {
    name: &'static str,
    tasks: Tasks,
}

impl Task {
    /// Reports that the task works, which clears its last failure.
    pub fn works(&self) {
        self.tasks.all().entry(self.name).or_default().down = None;
    }
}

impl Tasks {
    /// Keeps a task running until `stop`. It runs as its own Tokio task, so that a panic cannot stop others.
    pub async fn keep<F>(&self, name: &'static str, stop: &CancellationToken, begin: impl Fn(Task) -> F)
    where
        F: Future<Output = Result<(), Error>> + Send + 'static,
    {
        let mut pause = FIRST_PAUSE;
        loop {
            let begun = Instant::now();
            let task = begin(Task { name, tasks: self.clone() });
            let run = AbortOnDropHandle::new(tokio::spawn(stop.clone().run_until_cancelled_owned(task)));
            let reason = match run.await {
                Ok(None) => return,
                Ok(Some(Ok(()))) => "it stopped without an error".to_owned(),
                Ok(Some(Err(error))) => error.to_string(),
                Err(error) => words_of(error),
            };
            tracing::error!(task = name, reason, "a background task failed; restarting it");
            self.failed(name, reason);
            if begun.elapsed() > FAILURE_WINDOW {
                pause = FIRST_PAUSE;
            }
            if stop.run_until_cancelled(tokio::time::sleep(pause)).await.is_none() {
                return;
            }
            pause = (pause * 2).min(MAX_PAUSE);
        }
    }

    /// Which task is down or fails often, and why; `None` if all work.
    pub fn problem(&self) -> Option<String> {
        self.all().iter().find_map(|(name, state)| {
            let recent = state.failures.iter().filter(|at| at.elapsed() < FAILURE_WINDOW).count();
            match &state.down {
                Some(reason) => Some(format!("The task {name:?} is down: {}.", reason.trim_end_matches('.'))),
                None if recent >= FAILURE_LIMIT => {
                    let reason = state.reason.trim_end_matches('.');
                    Some(format!("The task {name:?} failed {recent} times within a minute. The last reason: {reason}."))
                }
                None => None,
            }
        })
    }

    fn failed(&self, name: &'static str, reason: String) {
        let mut all = self.all();
        let state = all.entry(name).or_default();
        state.failures.push_back(Instant::now());
        if state.failures.len() > FAILURE_LIMIT {
            state.failures.pop_front();
        }
        state.reason.clone_from(&reason);
        state.down = Some(reason);
    }

    fn all(&self) -> MutexGuard<'_, BTreeMap<&'static str, TaskState>> {
        // The map is consistent between statements, so a poisoned lock is usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn words_of(error: JoinError) -> String {
    match error.try_into_panic() {
        Ok(panic) => {
            let words = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
            let words = words.or_else(|| panic.downcast_ref::<String>().cloned());
            format!("it panicked: {}", words.unwrap_or_else(|| "no message".to_owned()))
        }
        Err(error) => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    async fn until(holds: impl Fn() -> bool) {
        for _ in 0..1000 {
            if holds() {
                return;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        panic!("it does not come to that");
    }

    #[tokio::test]
    async fn failed_task_is_reported_and_restarted() {
        let (tasks, stop, begun) = (Tasks::default(), CancellationToken::new(), Arc::new(AtomicUsize::new(0)));
        let kept = tokio::spawn({
            let (tasks, stop, begun) = (tasks.clone(), stop.clone(), Arc::clone(&begun));
            async move {
                let begin = |task: Task| {
                    let time = begun.fetch_add(1, Ordering::SeqCst);
                    async move {
                        match time {
                            0 => panic!("as asked"),
                            1 => return Err(Error::conflict("refused")),
                            _ => task.works(),
                        }
                        std::future::pending().await
                    }
                };
                tasks.keep("planning", &stop, begin).await;
            }
        });
        until(|| tasks.problem().as_deref() == Some("The task \"planning\" is down: it panicked: as asked.")).await;
        until(|| tasks.problem().as_deref() == Some("The task \"planning\" is down: refused.")).await;
        until(|| tasks.problem().is_none()).await;
        assert_eq!(begun.load(Ordering::SeqCst), 3);
        stop.cancel();
        kept.await.unwrap();
    }

    #[tokio::test]
    async fn repeatedly_failing_task_is_reported_while_it_runs() {
        let (tasks, task) = (Tasks::default(), "planning");
        for _ in 0..FAILURE_LIMIT {
            tasks.failed(task, "refused".to_owned());
            Task { name: task, tasks: tasks.clone() }.works();
        }
        assert_eq!(
            tasks.problem().as_deref(),
            Some("The task \"planning\" failed 5 times within a minute. The last reason: refused.")
        );
    }
}
