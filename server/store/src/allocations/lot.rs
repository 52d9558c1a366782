//! Draws of allocations: permuted blocks for lab sessions and fair coins for pairs, as pure functions of a random lot.

use crate::{StoreError, StoreResult};

/// Random bytes for one allocation, from the operating system except in tests.
#[derive(Debug, Clone, Copy)]
pub struct Lot {
    number: u64,
    nonce: [u8; 32],
}

/// A place in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    /// Whether gait one comes first.
    pub(super) one_first: bool,
    /// Size of the block, 2 or 4.
    pub(super) size: u8,
    /// Position in the block, from 1.
    pub(super) position: u8,
}

impl Lot {
    /// Draws a lot.
    ///
    /// # Errors
    /// If the operating system cannot provide random numbers.
    pub fn draw() -> StoreResult<Self> {
        let mut bytes = [0_u8; 40];
        getrandom::fill(&mut bytes).map_err(|e| StoreError::NoRandomNumbers(e.to_string()))?;
        let (mut number, mut nonce) = ([0; 8], [0; 32]);
        number.copy_from_slice(&bytes[..8]);
        nonce.copy_from_slice(&bytes[8..]);
        Ok(Self { number: u64::from_le_bytes(number), nonce })
    }

    /// A random number for draws that are not concealed.
    pub fn number(self) -> u64 {
        self.number
    }

    /// A fair coin.
    pub(super) fn coin(self) -> bool {
        self.number & 1 == 1
    }

    /// The nonce of the row. Without it, the hash of the row would reveal the allocation.
    pub(crate) fn nonce(self) -> String {
        hex::encode(self.nonce)
    }

    /// The next place after the taken ones of the open block. Without any, a new block of two or four begins. Every
    /// balanced order of a block is equally likely.
    pub(super) fn place(self, taken: &[Place]) -> Place {
        let size = taken.first().map_or(if self.coin() { 2 } else { 4 }, |first| first.size);
        let ones = taken.iter().filter(|place| place.one_first).count() as u64;
        let (used, half) = (taken.len() as u64, u64::from(size) / 2);
        let left = u64::from(size).saturating_sub(used).max(1);
        // The lowest bit is used by the coin.
        let one_first = (self.number >> 1) % left < half.saturating_sub(ones);
        Place { one_first, size, position: u8::try_from(used + 1).unwrap_or(size) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sha2::{Digest, Sha256};

    /// The 99.9th percentile of the chi-squared distribution with one degree of freedom.
    const CRITICAL: f64 = 10.83;

    fn lot(counter: u64) -> Lot {
        let digest = Sha256::digest(counter.to_le_bytes());
        Lot { number: digest.iter().take(8).fold(0, |n, byte| (n << 8) | u64::from(*byte)), nonce: [0; 32] }
    }

    fn chi_squared(count: usize, of: usize) -> f64 {
        let half = of as f64 / 2.0;
        2.0 * (count as f64 - half).powi(2) / half
    }

    /// The places of consecutive sessions.
    fn drawn(sessions: u64) -> Vec<Place> {
        let (mut all, mut open): (Vec<Place>, Vec<Place>) = (Vec::new(), Vec::new());
        for counter in 0..sessions {
            let place = lot(counter).place(&open);
            open.push(place);
            all.push(place);
            if place.position == place.size {
                open.clear();
            }
        }
        all
    }

    #[test]
    fn blocks_are_balanced_and_sizes_two_and_four_are_equally_frequent() {
        let all = drawn(30_000);
        let mut sizes = [0_usize; 2];
        let mut rest = &all[..];
        while let Some(first) = rest.first() {
            let Some((block, after)) = rest.split_at_checked(usize::from(first.size)) else { break };
            assert_eq!(block.iter().filter(|place| place.one_first).count() * 2, block.len(), "{block:?}");
            sizes[usize::from(first.size == 4)] += 1;
            rest = after;
        }
        assert!(chi_squared(sizes[0], sizes[0] + sizes[1]) < CRITICAL, "{sizes:?}");
    }

    #[test]
    fn allocations_of_10_000_sessions_are_balanced_at_every_place() {
        let all = drawn(10_000);
        for (size, place) in [(2, 1), (2, 2), (4, 1), (4, 2), (4, 3), (4, 4)] {
            let here: Vec<_> = all.iter().filter(|drawn| (drawn.size, drawn.position) == (size, place)).collect();
            let ones = here.iter().filter(|drawn| drawn.one_first).count();
            assert!(chi_squared(ones, here.len()) < CRITICAL, "place {place} of {size}: {ones} of {}", here.len());
        }
        let firsts: Vec<bool> = (0..10_000).map(|counter| lot(counter).place(&[]).one_first).collect();
        let ones = firsts.iter().filter(|one| **one).count();
        assert!(chi_squared(ones, firsts.len()) < CRITICAL, "first sessions of 10,000 studies: {ones}");
    }

    #[test]
    fn every_order_of_a_block_of_four_is_equally_likely() {
        let mut counts = std::collections::BTreeMap::<Vec<bool>, u32>::new();
        for block in 0..6000 {
            let mut open = vec![Place { one_first: lot(4 * block).coin(), size: 4, position: 1 }];
            for step in 1..4 {
                open.push(lot(4 * block + step).place(&open));
            }
            *counts.entry(open.iter().map(|place| place.one_first).collect()).or_default() += 1;
        }
        assert_eq!(counts.len(), 6, "{counts:?}");
        let chi: f64 = counts.values().map(|count| (f64::from(*count) - 1000.0).powi(2) / 1000.0).sum();
        // The 99.9th percentile with five degrees of freedom.
        assert!(chi < 20.52, "{chi}: {counts:?}");
    }

    #[test]
    fn sides_of_10_000_pairs_are_balanced_and_independent() {
        let coins: Vec<bool> = (0..10_000).map(|counter| lot(counter).coin()).collect();
        let ones = coins.iter().filter(|coin| **coin).count();
        let same = coins.windows(2).filter(|pair| pair[0] == pair[1]).count();
        assert!(chi_squared(ones, coins.len()) < CRITICAL, "{ones}");
        assert!(chi_squared(same, coins.len() - 1) < CRITICAL, "{same}");
    }

    #[test]
    fn random_lots_differ_in_number_and_nonce() {
        let (a, b) = (Lot::draw().unwrap(), Lot::draw().unwrap());
        assert!(a.number != b.number && a.nonce() != b.nonce() && a.nonce().len() == 64);
    }
}
