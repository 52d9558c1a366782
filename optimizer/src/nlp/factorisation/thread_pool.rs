//! Threads for work that comes again and again and takes well under a millisecond: starting a thread, or waking a sleeping
//! one, would cost as much. Between two calls they watch for the next one, for a while, then sleep.

use std::hint::spin_loop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{Builder, JoinHandle, park, yield_now};

/// Work that several threads share.
pub(super) trait Job: Send + Sync + 'static {
    /// Takes part, as thread number `member` (the caller is 0), until nothing is left.
    fn take_part(&self, member: usize);
}

/// Looks for a call before a thread lets others have the processor, and how often it does that before it sleeps.
const LOOKS: usize = 500;
const YIELDS: usize = 200;

#[derive(Debug, Default)]
struct Signal {
    /// Calls so far.
    calls: AtomicUsize,
    /// Members that have finished, all calls together.
    finished: AtomicUsize,
    /// A member panicked; nobody is called any more.
    failed: AtomicBool,
    closed: AtomicBool,
}

/// Threads beside the caller's.
pub(super) struct ThreadPool {
    signal: Arc<Signal>,
    members: Vec<JoinHandle<()>>,
}

impl ThreadPool {
    /// Threads for a job, as many as asked for beside the caller's, or as can be had.
    pub(super) fn new<J: Job>(job: &Arc<J>, others: usize) -> Self {
        let signal = Arc::new(Signal::default());
        let start = |member: usize| {
            let (job, signal) = (Arc::clone(job), Arc::clone(&signal));
            Builder::new().name("front".to_owned()).spawn(move || serve(&*job, &signal, member)).ok()
        };
        Self { members: (1..=others).map_while(start).collect(), signal }
    }

    /// Does the job with all members. False when one panicked: what it was doing is not done.
    pub(super) fn call(&self, job: &impl Job) -> bool {
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
            if looks % LOOKS == 0 { yield_now() } else { spin_loop() }
        }
        !signal.failed.load(Ordering::Acquire)
    }
}

impl Drop for ThreadPool {
    fn drop(&mut self) {
        self.signal.closed.store(true, Ordering::Release);
        for member in self.members.drain(..) {
            member.thread().unpark();
            // A member that panicked has been heard of already.
            let _ = member.join();
        }
    }
}

/// What a member does until the [`ThreadPool`] is dropped.
fn serve(job: &impl Job, signal: &Signal, member: usize) {
    let (mut heard, mut looks) = (0, 0);
    while !signal.closed.load(Ordering::Acquire) {
        if signal.calls.load(Ordering::Acquire) > heard {
            (heard, looks) = (heard + 1, 0);
            if catch_unwind(AssertUnwindSafe(|| job.take_part(member))).is_err() {
                signal.failed.store(true, Ordering::Release);
            }
            signal.finished.fetch_add(1, Ordering::Release);
            continue;
        }
        looks += 1;
        if looks >= LOOKS * YIELDS {
            park();
            looks = 0;
        } else if looks % LOOKS == 0 {
            yield_now();
        } else {
            spin_loop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    struct Count {
        left: AtomicUsize,
        by_member: Mutex<Vec<usize>>,
        panics: AtomicBool,
    }

    impl Job for Count {
        fn take_part(&self, member: usize) {
            assert!(member == 0 || !self.panics.load(Ordering::Relaxed), "as the test wants it");
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
    fn nlp_every_call_is_done_when_it_returns_also_after_a_sleep() {
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
    fn nlp_a_member_that_panics_is_told_of_and_not_waited_for() {
        let job = count(2);
        let threads = ThreadPool::new(&job, 1);
        job.panics.store(true, Ordering::Relaxed);
        job.left.store(10, Ordering::Release);
        assert!(!threads.call(&*job));
        job.left.store(10, Ordering::Release);
        assert!(threads.call(&*job), "the caller does it alone");
        assert_eq!(job.left.load(Ordering::Acquire), 0);
    }
}
