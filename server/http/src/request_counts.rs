//! Counts and durations of requests.

use axum::http::StatusCode;
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Upper bounds of the histogram buckets, s.
pub(crate) const BUCKETS: [f64; 8] = [0.001, 0.005, 0.025, 0.1, 0.25, 1.0, 5.0, 30.0];

/// Requests by method, route and status class.
#[derive(Debug, Default)]
pub struct Requests(Mutex<BTreeMap<(String, String, u16), RouteCounts>>);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RouteCounts {
    pub(crate) count: u64,
    pub(crate) seconds: f64,
    pub(crate) within: [u64; BUCKETS.len()],
}

impl Requests {
    pub(crate) fn add(&self, method: String, route: String, status: StatusCode, seconds: f64) {
        let mut map = self.map();
        let counts = map.entry((method, route, status.as_u16())).or_default();
        counts.count += 1;
        counts.seconds += seconds;
        for (within, end) in counts.within.iter_mut().zip(BUCKETS) {
            *within += u64::from(seconds <= end);
        }
    }

    pub(crate) fn map(&self) -> MutexGuard<'_, BTreeMap<(String, String, u16), RouteCounts>> {
        // The map is consistent between statements, so a poisoned lock is usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
