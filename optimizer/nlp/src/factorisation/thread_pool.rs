//! A thread pool for short, repeated work: starting or waking a thread takes as long as one call, well under a
//! millisecond. Between calls the threads spin for a while before they sleep.

use std::hint::spin_loop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle, park, yield_now};

/// Work that several threads share in one call.
pub(super) trait SharedWork: Send + Sync + 'static {
    /// Takes part as thread number `member` (the caller is 0) until all work is done.
    fn take_part(&self, member: usize);
}

/// Checks for a call before a thread yields, and yields before it sleeps.
const CHECKS_BEFORE_YIELD: usize = 500;
const YIELDS: usize = 200;

#[derive(Debug, Default)]
struct Signal {
    /// Number of calls.
    calls: AtomicUsize,
    /// Number of finished members, summed over all calls.
    finished: AtomicUsize,
    /// A member panicked; from then on the caller works alone.
    failed: AtomicBool,
    closed: AtomicBool,
}

/// Threads in addition to the caller.
pub(super) struct ThreadPool {
    signal: Arc<Signal>,
    members: Vec<JoinHandle<()>>,
}

impl ThreadPool {
    /// Starts `others` threads in addition to the caller, or as many as the system allows.
    pub(super) fn new<J: SharedWork>(job: &Arc<J>, others: usize) -> Self {
        let signal = Arc::new(Signal::default());
        let start = |member: usize| {
            let (job, signal) = (Arc::clone(job), Arc::clone(&signal));
            Builder::new().name("front".to_owned()).spawn(move || serve(&*job, &signal, member)).ok()
        };
        Self { members: (1..=others).map_while(start).collect(), signal }
    }

    /// Does the work with all members. False when one panicked, and its part is not done.
    pub(super) fn call(&self, job: &impl SharedWork) -> bool {
        let signal = &*self.signal;
        if signal.failed.load(Ordering::Acquire) || self.members.is_empty() {
            job.take_part(0);
            return true;
        }
        let calls = signal.calls.fetch_add(1, Ordering::AcqRel) + 1;
        self.members.iter().for_each(|member| member.thread().unpark());
        job.take_part(0);
        let mut looks = 0;
        while signal.finished.load(Ordering::Acquire) < calls * self.members.len() {
            looks += 1;
            if looks % CHECKS_BEFORE_YIELD == 0 { yield_now() } else { spin_loop() }
        }
        !signal.failed.load(Ordering::Acquire)
    }
}

impl Drop for ThreadPool {
    fn drop(&mut self) {
        self.signal.closed.store(true, Ordering::Release);
        for member in self.members.drain(..) {
            member.thread().unpark();
            // The panic of a member was reported by `call`.
            let _ = member.join();
        }
    }
}

/// The loop of a member until the [`ThreadPool`] is dropped.
fn serve(job: &impl SharedWork, signal: &Signal, member: usize) {
    let (mut calls_seen, mut looks) = (0, 0);
    while !signal.closed.load(Ordering::Acquire) {
        if signal.calls.load(Ordering::Acquire) > calls_seen {
            (calls_seen, looks) = (calls_seen + 1, 0);
            if catch_unwind(AssertUnwindSafe(|| job.take_part(member))).is_err() {
                signal.failed.store(true, Ordering::Release);
            }
            signal.finished.fetch_add(1, Ordering::Release);
            continue;
        }
        looks += 1;
        if looks >= CHECKS_BEFORE_YIELD * YIELDS {
            park();
            looks = 0;
        } else if looks % CHECKS_BEFORE_YIELD == 0 {
            yield_now();
        } else {
            spin_loop();
        }
    }
}

/// Locks data that is consistent at any time, so that a poisoned lock can be used.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Count {
        left: AtomicUsize,
        by_member: Mutex<Vec<usize>>,
        panics: AtomicBool,
    }

    impl SharedWork for Count {
        fn take_part(&self, member: usize) {
            assert!(member == 0 || !self.panics.load(Ordering::Relaxed), "panic of the test");
            while self.left.fetch_update(Ordering::AcqRel, Ordering::Acquire, |left| left.checked_sub(1)).is_ok() {
                if let Ok(mut counts) = self.by_member.lock() {
                    counts[member] += 1;
                }
            }
        }
    }

    fn count(members: usize) -> Arc<Count> {
        Arc::new(Count {
            left: AtomicUsize::new(0),
            by_member: Mutex::new(vec![0; members]),
            panics: AtomicBool::new(false),
        })
    }

    #[test]
    fn work_is_complete_when_a_call_returns_even_after_sleep() {
        let job = count(3);
        let threads = ThreadPool::new(&job, 2);
        for round in 1..=50 {
            job.left.store(100, Ordering::Release);
            assert!(threads.call(&*job));
            assert_eq!(job.by_member.lock().map(|counts| counts.iter().sum::<usize>()).ok(), Some(100 * round));
            if round == 25 {
                std::thread::sleep(std::time::Duration::from_millis(300));
            }
        }
    }

    #[test]
    fn panic_of_a_member_is_reported_and_does_not_block_later_calls() {
        let job = count(2);
        let threads = ThreadPool::new(&job, 1);
        job.panics.store(true, Ordering::Relaxed);
        job.left.store(10, Ordering::Release);
        assert!(!threads.call(&*job));
        job.left.store(10, Ordering::Release);
        assert!(threads.call(&*job), "the caller works alone");
        assert_eq!(job.left.load(Ordering::Acquire), 0);
    }
}
