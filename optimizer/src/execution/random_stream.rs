//! Random draws of a simulated walk. Each walk has a stream of its own, so that its draws depend neither on other walks
//! nor on threads.
//!
//! The learner has a generator of its own (`learner/src/random.rs`): neither crate depends on the other, and with another
//! generator the seeds of stored reports, or of studies, would no longer give the same numbers.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Number of values of the significand of an `f64`.
const SIGNIFICANDS: f64 = 9_007_199_254_740_992.0;

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub(super) struct RandomStream(ChaCha8Rng);

impl RandomStream {
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(stream);
        Self(generator)
    }

    /// Uniform in `[0, 1)`.
    pub(super) fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / SIGNIFICANDS
    }

    /// Uniform in `[-largest, largest)`.
    pub(super) fn within(&mut self, largest: f64) -> f64 {
        largest * (2.0 * self.uniform() - 1.0)
    }

    /// Standard normal, by the method of Box and Muller.
    pub(super) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}
