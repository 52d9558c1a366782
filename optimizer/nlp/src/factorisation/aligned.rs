//! Arrays aligned to cache lines: a vector of eight numbers that straddles two lines costs two accesses.

use std::ops::{Deref, DerefMut};

/// Bytes of a cache line.
const LINE: usize = 64;
const PER_LINE: usize = LINE / size_of::<f64>();

/// A cache-aligned array of fixed length. Alignment affects speed only, never results.
#[derive(Debug, Default)]
pub(super) struct Aligned {
    store: Vec<f64>,
    start: usize,
    end: usize,
}

impl Aligned {
    pub(super) fn zeros(length: usize) -> Self {
        let store = vec![0.0; length + PER_LINE];
        let start = store.as_ptr().align_offset(LINE).min(PER_LINE);
        Self { store, start, end: start + length }
    }
}

impl Deref for Aligned {
    type Target = [f64];

    #[inline]
    fn deref(&self) -> &[f64] {
        &self.store[self.start..self.end]
    }
}

impl DerefMut for Aligned {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.store[self.start..self.end]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aligned_arrays_start_at_a_cache_line_and_have_the_requested_length() {
        for length in [0, 1, 7, 8, 1000, 100_000] {
            let numbers = Aligned::zeros(length);
            assert_eq!(numbers.len(), length);
            assert!(numbers.iter().all(|v| *v == 0.0));
            assert_eq!(numbers.as_ptr().align_offset(LINE), 0);
        }
    }
}
