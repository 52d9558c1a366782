//! Seeds for the random draws of the learner, derived from (study seed, purpose, counter), never from time or order of
//! arrival. Allocations do not use them: the operating system draws those (`store::allocations`).

use sha2::{Digest, Sha256};

/// The largest seed: many JSON readers keep only 53 bits of an integer.
pub const MAX_SEED: u64 = (1 << 53) - 1;

/// The purpose of a draw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// The proposal of the trial with this number.
    Proposal,
}

/// The seed for one draw.
pub fn derive(study_seed: u64, purpose: Purpose, counter: u64) -> u64 {
    let name = match purpose {
        Purpose::Proposal => "proposal",
    };
    let mut hash = Sha256::new();
    hash.update(study_seed.to_le_bytes());
    hash.update(name.as_bytes());
    hash.update(counter.to_le_bytes());
    let digest = hash.finalize();
    let mut first = [0_u8; 8];
    first.copy_from_slice(&digest[..8]);
    u64::from_le_bytes(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_depend_on_study_and_counter_alone() {
        let seeds = [derive(1, Purpose::Proposal, 1), derive(2, Purpose::Proposal, 1), derive(1, Purpose::Proposal, 2)];
        for (i, a) in seeds.iter().enumerate() {
            assert!(seeds[i + 1..].iter().all(|b| a != b));
        }
        assert_eq!(seeds[0], derive(1, Purpose::Proposal, 1));
    }
}
