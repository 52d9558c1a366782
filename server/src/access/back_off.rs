//! Login back-off: each failed attempt for a name doubles the wait before the next one is even looked at.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Failures that cost nothing: people mistype.
const FREE: u32 = 3;
/// The longest wait.
const LONGEST: Duration = Duration::from_mins(15);
/// Names remembered at most; beyond it those that wait least are forgotten.
const MOST_NAMES: usize = 10_000;

#[derive(Debug, Clone, Copy)]
struct Failures {
    count: u32,
    until: Instant,
}

/// Failed attempts by name.
#[derive(Debug, Default)]
pub struct BackOff(Mutex<HashMap<String, Failures>>);

impl BackOff {
    /// Begins an attempt, which counts as failed until it has succeeded: many at once are as many as one after the
    /// other. `Err`: how long the name must still wait.
    ///
    /// # Errors
    /// The wait.
    pub fn begin(&self, name: &str, now: Instant) -> Result<(), Duration> {
        let mut names = self.names();
        let until = names.get(&name.to_lowercase()).map(|failures| failures.until);
        if let Some(wait) = until.and_then(|until| until.checked_duration_since(now)).filter(|wait| !wait.is_zero()) {
            return Err(wait);
        }
        if names.len() >= MOST_NAMES {
            names.retain(|_, failures| failures.until > now);
            if names.len() >= MOST_NAMES {
                names.clear();
            }
        }
        let failures = names.entry(name.to_lowercase()).or_insert(Failures { count: 0, until: now });
        failures.count = failures.count.saturating_add(1);
        failures.until = now + wait_after(failures.count);
        Ok(())
    }

    /// An attempt has failed: the wait begins now.
    pub fn failed(&self, name: &str, now: Instant) {
        if let Some(failures) = self.names().get_mut(&name.to_lowercase()) {
            failures.until = failures.until.max(now + wait_after(failures.count));
        }
    }

    /// Forgets the failures of a name that signed in.
    pub fn succeeded(&self, name: &str) {
        self.names().remove(&name.to_lowercase());
    }

    fn names(&self) -> MutexGuard<'_, HashMap<String, Failures>> {
        // The map is whole between any two statements that hold the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn wait_after(failures: u32) -> Duration {
    match failures.checked_sub(FREE) {
        None | Some(0) => Duration::ZERO,
        Some(more) => Duration::from_secs(1 << more.min(10)).min(LONGEST),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_after_three_failures_and_end_with_a_success() {
        let back_off = BackOff::default();
        let now = Instant::now();
        for _ in 0..4 {
            assert_eq!(back_off.begin("Ada", now), Ok(()));
        }
        let mut later = now + Duration::from_secs(1);
        back_off.failed("ADA", later);
        for seconds in [2, 4, 8, 16, 32] {
            let wait = Duration::from_secs(seconds);
            assert_eq!(back_off.begin("ada", later), Err(wait));
            later += wait;
            assert_eq!(back_off.begin("ada", later), Ok(()));
        }
        assert_eq!(back_off.begin("bob", now), Ok(()), "others do not wait");
        back_off.succeeded("ADA");
        assert_eq!(back_off.begin("ada", later), Ok(()));
    }

    #[test]
    fn no_wait_is_longer_than_a_quarter_of_an_hour() {
        assert_eq!(wait_after(u32::MAX), LONGEST);
    }
}
