//! The thread pool for long computations, which must not run on request threads or while a database connection is held.
//!
//! Two types hold this. A function that computes for long takes an [`OnPool`], which only a thread of a [`Pool`] has.
//! And `Store::compute` of the record borrows the store exclusively, while every connection borrows it shared: the
//! compiler refuses to compute while a connection is held.

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod priority;

use priority::{COMPUTING, STACK_BYTES, lower_priority};
use std::sync::Arc;
use thiserror::Error;
use tokio::sync::{Semaphore, oneshot};

/// Proof that the caller runs on a thread of a [`Pool`]. Nothing else can create one.
#[derive(Debug)]
pub struct OnPool(());

/// Why a computation gave no result.
#[derive(Debug, Error)]
pub enum ComputeError {
    /// It panicked.
    #[error("A computation panicked.")]
    Panicked,
    /// No thread can be started.
    #[error("Cannot start a thread for a computation: {0}.")]
    NoThread(#[from] std::io::Error),
    /// The service is shutting down.
    #[error("The computation was not started because the service is shutting down.")]
    Closed,
}

/// Runs a limited number of long computations in parallel. Others wait without a thread.
#[derive(Debug, Clone)]
pub struct Pool {
    places: Arc<Semaphore>,
    has_lower_priority: bool,
}

impl Default for Pool {
    /// One computation for each core, at least two, at lower priority than requests.
    fn default() -> Self {
        let size = std::thread::available_parallelism().map_or(2, |cores| cores.get().max(2));
        Self { has_lower_priority: true, ..Self::new(size) }
    }
}

impl Pool {
    /// A pool of `size` threads (at least one).
    pub fn new(size: usize) -> Self {
        Self { places: Arc::new(Semaphore::new(size.max(1))), has_lower_priority: false }
    }

    /// Computes as soon as a thread is free. Work that has started continues, and keeps its slot, even if the caller
    /// drops the future.
    ///
    /// # Errors
    /// [`ComputeError`] if the work panics or the process ends.
    pub async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce(&OnPool) -> T + Send + 'static,
    ) -> Result<T, ComputeError> {
        let place = Arc::clone(&self.places).acquire_owned().await.map_err(|_| ComputeError::Closed)?;
        let (sender, result) = oneshot::channel();
        let has_lower_priority = self.has_lower_priority;
        let work = move || {
            let _place = place;
            if has_lower_priority {
                lower_priority(COMPUTING);
            }
            // Fails only if the caller went away.
            let _ = sender.send(work(&OnPool(())));
        };
        std::thread::Builder::new().name("compute".to_owned()).stack_size(STACK_BYTES).spawn(work)?;
        result.await.map_err(|_| ComputeError::Panicked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    #[tokio::test(flavor = "multi_thread")]
    async fn pool_never_runs_more_computations_than_threads() {
        let pool = Pool::new(2);
        let (running, most) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
        let all = (0..8).map(|_| {
            let (pool, running, most) = (pool.clone(), Arc::clone(&running), Arc::clone(&most));
            tokio::spawn(async move {
                let work = move |_: &OnPool| {
                    most.fetch_max(running.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                    std::thread::sleep(Duration::from_millis(20));
                    running.fetch_sub(1, Ordering::SeqCst);
                };
                pool.run(work).await.unwrap();
            })
        });
        for one in all.collect::<Vec<_>>() {
            one.await.unwrap();
        }
        assert_eq!(most.load(Ordering::SeqCst), 2);
    }

    #[tokio::test]
    async fn panic_becomes_an_error_and_frees_the_thread() {
        let pool = Pool::new(1);
        assert!(matches!(pool.run(|_| panic!("as asked")).await, Err::<(), _>(ComputeError::Panicked)));
        assert_eq!(pool.run(|_| 1).await.unwrap(), 1);
    }
}
