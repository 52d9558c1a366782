//! Draws of allocations: biased coins for lab sessions (Efron 1971) and fair coins for pairs, as pure functions of a
//! random draw and, for sessions, of the lead of one order over the other.
//!
//! Only unblinded allocations bias the coin of a session. A concealed one thus says nothing about any other, and nobody
//! who sees everything else guesses it with a probability above [`BIAS`], whatever the order of planning and unblinding.

use crate::{Connection, StoreError, StoreResult};
use sqlx::Row;

/// Random bytes for one allocation, from the operating system except in tests.
#[derive(Debug, Clone, Copy)]
pub struct RandomDraw {
    number: u64,
    nonce: [u8; 32],
}

/// The lead of one order over the other from which the coin is biased.
const TOLERANCE: u64 = 3;
/// How many of 4 biased draws even out the lead.
const BIAS: u64 = 3;

impl RandomDraw {
    /// Draws a random number.
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

    /// Whether gait A comes first. `lead` is how many more unblinded sessions gait A came first in than gait B.
    /// The coin is fair up to a lead of two; at three or more, the rarer order has a probability of three quarters.
    pub(super) fn gait_a_first(self, lead: i64) -> bool {
        if lead.unsigned_abs() < TOLERANCE {
            return self.coin();
        }
        let evens_out = self.number % 4 < BIAS;
        evens_out == (lead < 0)
    }
}

/// The number of unblinded sessions with this number in which gait A came first, less those in which gait B did. A
/// concealed allocation does not count, because later ones would reveal it once they are unblinded. Nor does an
/// imported one, which another service balanced.
pub(super) async fn lead(db: &mut Connection, number: u32) -> StoreResult<i64> {
    let row = sqlx::query(
        "select coalesce(sum(2 * a.gait_a_first - 1), 0) from lab_sessions l \
         join lab_session_steps t on t.lab_session_id = l.id and t.step = 'unblinded' \
         join lab_allocations a on a.lab_session_id = l.id \
         where l.number = ? and l.study_id not in (select study_id from imports)",
    );
    Ok(row.bind(number).fetch_one(db).await?.try_get(0)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sha2::{Digest, Sha256};

    /// The 99.9th percentile of the chi-squared distribution with one degree of freedom.
    const CRITICAL: f64 = 10.83;

    fn random(counter: u64) -> RandomDraw {
        let digest = Sha256::digest(counter.to_le_bytes());
        RandomDraw { number: digest.iter().take(8).fold(0, |n, byte| (n << 8) | u64::from(*byte)), nonce: [0; 32] }
    }

    fn chi_squared(count: usize, of: usize) -> f64 {
        let half = of as f64 / 2.0;
        2.0 * (count as f64 - half).powi(2) / half
    }

    /// Probability of the likelier order of a draw, which the best guesser knows.
    fn best_guess(lead: i64) -> f64 {
        if lead.unsigned_abs() < TOLERANCE { 0.5 } else { 0.75 }
    }

    /// Sessions one after the other, each unblinded before the next is planned: the leads before each draw, and the orders.
    fn in_order(sessions: u64) -> Vec<(i64, bool)> {
        let mut lead = 0;
        let next = |counter| {
            let gait_a_first = random(counter).gait_a_first(lead);
            let drawn = (lead, gait_a_first);
            lead += if gait_a_first { 1 } else { -1 };
            drawn
        };
        (0..sessions).map(next).collect()
    }

    #[test]
    fn sessions_unblinded_one_by_one_stay_balanced() {
        let leads: Vec<u64> = in_order(100_000).iter().map(|(lead, _)| lead.unsigned_abs()).collect();
        let share = |least: u64| leads.iter().filter(|lead| **lead >= least).count() as f64 / leads.len() as f64;
        // Exact: 2/7 at three or more, then a third for each further one.
        for (least, exact) in [(3, 2.0 / 7.0), (4, 2.0 / 21.0), (5, 2.0 / 63.0), (6, 2.0 / 189.0)] {
            assert!((share(least) - exact).abs() < 0.1 * exact, "a lead of {least}: {} for {exact}", share(least));
        }
        assert!(leads.iter().all(|lead| *lead <= 14), "{:?}", leads.iter().max());
    }

    #[test]
    fn best_guesser_is_right_in_four_of_seven_and_never_above_75_percent_certain() {
        let drawn = in_order(100_000);
        let (mut right, mut at_bias) = (0_u32, (0_u32, 0_u32));
        for (lead, gait_a_first) in &drawn {
            let guess = *lead < 0;
            right += u32::from(guess == *gait_a_first);
            if lead.unsigned_abs() >= TOLERANCE {
                at_bias = (at_bias.0 + u32::from(guess == *gait_a_first), at_bias.1 + 1);
            }
        }
        let share = f64::from(right) / drawn.len() as f64;
        assert!((share - 4.0 / 7.0).abs() < 0.006, "{share}");
        let biased = f64::from(at_bias.0) / f64::from(at_bias.1);
        assert!((biased - 0.75).abs() < 0.01, "{biased}");
    }

    /// Sessions are planned and unblinded in any order. The guesser sees every unblinded allocation, also of sessions that
    /// were planned later, and knows the rule.
    #[test]
    fn best_guesser_learns_nothing_from_other_sessions() {
        let (mut lead, mut concealed) = (0_i64, Vec::new());
        let (mut expected, mut right, mut of) = (0.0, 0_u32, 0_u32);
        for counter in 0..200_000_u64 {
            let RandomDraw { number: choice, .. } = random(1_000_000 + counter);
            if concealed.len() < 2 || (concealed.len() < 6 && choice % 2 == 0) {
                concealed.push((lead, random(counter).gait_a_first(lead)));
                continue;
            }
            let at = usize::try_from(choice >> 1).unwrap_or(usize::MAX) % concealed.len();
            let (lead_then, gait_a_first) = concealed.swap_remove(at);
            // The rarer order when it was planned; at a fair coin, what would even out the present lead.
            let guess = if lead_then.unsigned_abs() >= TOLERANCE { lead_then < 0 } else { lead < 0 };
            expected += best_guess(lead_then);
            right += u32::from(guess == gait_a_first);
            of += 1;
            lead += if gait_a_first { 1 } else { -1 };
        }
        let deviation = 0.5 * f64::from(of).sqrt();
        assert!((f64::from(right) - expected).abs() < 4.0 * deviation, "{right} of {of}, expected {expected}");
        assert!(f64::from(right) / f64::from(of) < 0.62, "{right} of {of}");
    }

    #[test]
    fn sides_of_10_000_pairs_are_balanced_and_independent() {
        let coins: Vec<bool> = (0..10_000).map(|counter| random(counter).coin()).collect();
        let ones = coins.iter().filter(|coin| **coin).count();
        let same = coins.windows(2).filter(|pair| pair[0] == pair[1]).count();
        assert!(chi_squared(ones, coins.len()) < CRITICAL, "{ones}");
        assert!(chi_squared(same, coins.len() - 1) < CRITICAL, "{same}");
    }

    #[test]
    fn random_lots_differ_in_number_and_nonce() {
        let (a, b) = (RandomDraw::draw().unwrap(), RandomDraw::draw().unwrap());
        assert!(a.number != b.number && a.nonce() != b.nonce() && a.nonce().len() == 64);
    }
}
