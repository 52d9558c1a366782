//! The time limit of a solve, which all its runs and phases share.

use super::options::SolveOptions;
use std::time::Instant;

/// Time that is left to a solve since it started, s; infinite without a limit.
pub(super) fn remaining_s(options: &SolveOptions, started: Instant) -> f64 {
    options.time_limit_s.map_or(f64::INFINITY, |limit| (limit - started.elapsed().as_secs_f64()).max(0.0))
}
