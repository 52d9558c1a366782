//! Tasks that the service needs as long as it runs. One that fails or panics is begun again, after longer and longer pauses,
//! and the service says that it is not ready while one is down or fails often.

use crate::error::Error;
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::task::JoinError;
use tokio_util::sync::CancellationToken;
use tokio_util::task::AbortOnDropHandle;

/// Pause before a task is begun again; twice as long after each failure that follows soon.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
/// Longest of these pauses.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);
/// A task that fails so often within [`RECENTLY`] is reported even while it runs.
const OFTEN: usize = 5;
/// See [`OFTEN`].
const RECENTLY: Duration = Duration::from_mins(1);

/// How the tasks of the service are.
#[derive(Debug, Clone, Default)]
pub struct Tasks(Arc<Mutex<BTreeMap<&'static str, State>>>);

#[derive(Debug, Default)]
struct State {
    /// Why it is down; none: it runs.
    down: Option<String>,
    /// The last failures, the newest last, with the reason of that.
    failures: VecDeque<Instant>,
    reason: String,
}

/// A running task, to say that it works.
#[derive(Debug, Clone)]
pub struct Task {
    name: &'static str,
    tasks: Tasks,
}

impl Task {
    /// The task works: what it failed for before is over.
    pub fn works(&self) {
        self.tasks.all().entry(self.name).or_default().down = None;
    }
}

impl Tasks {
    /// Keeps a task running until `stop`. It runs as a task of its own, so that a panic ends nothing else.
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
                Ok(Some(Ok(()))) => "it ended".to_owned(),
                Ok(Some(Err(error))) => error.to_string(),
                Err(error) => words_of(error),
            };
            tracing::error!(task = name, reason, "a task of the service failed; it is begun again");
            self.failed(name, reason);
            if begun.elapsed() > RECENTLY {
                pause = FIRST_PAUSE;
            }
            if stop.run_until_cancelled(tokio::time::sleep(pause)).await.is_none() {
                return;
            }
            pause = (pause * 2).min(LONGEST_PAUSE);
        }
    }

    /// Which task is down or fails often, and why; none: all work.
    pub fn trouble(&self) -> Option<String> {
        self.all().iter().find_map(|(name, state)| {
            let recent = state.failures.iter().filter(|at| at.elapsed() < RECENTLY).count();
            match &state.down {
                Some(reason) => Some(format!("{name} is down: {reason}")),
                None if recent >= OFTEN => {
                    Some(format!("{name} failed {recent} times within a minute, the last time: {}", state.reason))
                }
                None => None,
            }
        })
    }

    fn failed(&self, name: &'static str, reason: String) {
        let mut all = self.all();
        let state = all.entry(name).or_default();
        state.failures.push_back(Instant::now());
        if state.failures.len() > OFTEN {
            state.failures.pop_front();
        }
        state.reason.clone_from(&reason);
        state.down = Some(reason);
    }

    fn all(&self) -> MutexGuard<'_, BTreeMap<&'static str, State>> {
        // The map is whole between any two statements that hold the lock.
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
    async fn a_task_that_panics_or_fails_is_reported_and_begun_again() {
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
        until(|| tasks.trouble().as_deref() == Some("planning is down: it panicked: as asked")).await;
        until(|| tasks.trouble().as_deref() == Some("planning is down: refused")).await;
        until(|| tasks.trouble().is_none()).await;
        assert_eq!(begun.load(Ordering::SeqCst), 3);
        stop.cancel();
        kept.await.unwrap();
    }

    #[tokio::test]
    async fn a_task_that_fails_again_and_again_is_reported_while_it_runs() {
        let (tasks, task) = (Tasks::default(), "planning");
        for _ in 0..OFTEN {
            tasks.failed(task, "refused".to_owned());
            Task { name: task, tasks: tasks.clone() }.works();
        }
        assert_eq!(tasks.trouble().as_deref(), Some("planning failed 5 times within a minute, the last time: refused"));
    }
}
