//! Random draws of the learner: every one derives from (study seed, purpose, counter), never from time or order of arrival.
//! What blinds people is drawn by the operating system instead (`store::allocations`).

use sha2::{Digest, Sha256};

/// What a draw is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Proposing the trial with this number.
    Proposal,
    /// Draws behind what is shown of the learner's belief.
    Belief,
}

/// The seed for one draw.
pub fn derive(study_seed: u64, purpose: Purpose, counter: u64) -> u64 {
    let name = match purpose {
        Purpose::Proposal => "proposal",
        Purpose::Belief => "belief",
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
    fn draws_differ_by_seed_purpose_and_counter_and_never_change() {
        let seeds = [
            derive(1, Purpose::Proposal, 1),
            derive(2, Purpose::Proposal, 1),
            derive(1, Purpose::Belief, 1),
            derive(1, Purpose::Proposal, 2),
        ];
        for (i, a) in seeds.iter().enumerate() {
            assert!(seeds[i + 1..].iter().all(|b| a != b));
        }
        assert_eq!(seeds[0], derive(1, Purpose::Proposal, 1));
    }
}
