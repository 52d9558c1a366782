//! The clock for sessions and tokens. It never runs backwards, so that they stay expired when the machine's clock is
//! set back.

use crate::error::Error;
use gaitwright_store::{Connection, Instant, access_clock};
use std::fmt;
use std::sync::{Mutex, PoisonError};
use std::time::Instant as Steady;

/// The later of the machine's clock and the latest known instant plus the time passed since.
pub struct Clock {
    machine: Box<dyn Fn() -> Instant + Send + Sync>,
    /// The latest instant, and the monotonic time at which it was read.
    latest: Mutex<(Instant, Steady)>,
}

impl Clock {
    /// Uses another clock in place of the machine's.
    pub fn over(machine: impl Fn() -> Instant + Send + Sync + 'static) -> Self {
        let latest = Mutex::new((machine(), Steady::now()));
        Self { machine: Box::new(machine), latest }
    }

    /// The current instant, never before the latest one in the record.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn now(&self, db: &mut Connection) -> Result<Instant, Error> {
        let recorded = access_clock::latest(db).await?;
        Ok(self.at_least(recorded))
    }

    fn at_least(&self, recorded: Option<Instant>) -> Instant {
        let machine = (self.machine)();
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        let (seen, since) = *latest;
        let now = seen.after(since.elapsed());
        let ahead = recorded.filter(|recorded| *recorded > now).unwrap_or(now).max(machine);
        if ahead > now {
            *latest = (ahead, Steady::now());
        }
        ahead
    }
}

impl Default for Clock {
    fn default() -> Self {
        Self::over(gaitwright_store::now)
    }
}

impl fmt::Debug for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Clock").finish_non_exhaustive()
    }
}

/// The later of the machine's clock and the latest instant in the record.
///
/// # Errors
/// Errors of the database.
pub async fn recorded(db: &mut Connection) -> Result<Instant, Error> {
    let latest = access_clock::latest(db).await?;
    Ok(latest.map_or_else(gaitwright_store::now, |latest| latest.max(gaitwright_store::now())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicI64, Ordering};

    #[test]
    fn clock_that_is_set_back_continues_from_the_latest_instant() {
        let start = gaitwright_store::now();
        let offset = Arc::new(AtomicI64::new(0));
        let clock = Clock::over({
            let offset = Arc::clone(&offset);
            move || start.plus_seconds(offset.load(Ordering::SeqCst))
        });
        assert!(clock.at_least(None) >= start);
        offset.store(3600, Ordering::SeqCst);
        assert!(clock.at_least(None) >= start.plus_seconds(3600));
        offset.store(-3600, Ordering::SeqCst);
        let back = clock.at_least(None);
        assert!(back >= start.plus_seconds(3600));
        std::thread::sleep(std::time::Duration::from_millis(5));
        assert!(clock.at_least(None) > back, "time passes all the same");
        let recorded = start.plus_seconds(7200);
        assert!(clock.at_least(Some(recorded)) >= recorded, "a restart does not forget it");
        assert!(clock.at_least(None) >= recorded);
    }
}
