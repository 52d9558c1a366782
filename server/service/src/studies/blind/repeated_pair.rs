//! Chooses whether a rater is shown an earlier pair again, to measure how consistently the rater answers.

use gaitwright_store::TrialId;
use gaitwright_store::blind_pairs::{BlindPair, BlindPairKind, OrderedAnswer};

/// One in this many blind pairs repeats an earlier pair.
const REPEAT_ONE_IN: u64 = 10;

/// The pair that is repeated; `None` if a new one is due or no pair can be repeated.
pub(super) fn repeated_pair<'a>(random: u64, before: &'a [BlindPair], reported: &[TrialId]) -> Option<&'a BlindPair> {
    if !random.is_multiple_of(REPEAT_ONE_IN) {
        return None;
    }
    repeatable(before, reported, random / REPEAT_ONE_IN)
}

/// An earlier pair with a plain answer that has not been repeated.
fn repeatable<'a>(before: &'a [BlindPair], reported: &[TrialId], random: u64) -> Option<&'a BlindPair> {
    let plain = |shown: &&BlindPair| {
        shown.kind == BlindPairKind::New
            && shown.answer.is_some_and(is_plain)
            && !shown.has_one_of(reported)
            && !before.iter().any(|other| other.repeats == Some(shown.id))
    };
    let candidates: Vec<&BlindPair> = before.iter().filter(plain).collect();
    let index = random.checked_rem(candidates.len() as u64)?;
    candidates.get(usize::try_from(index).ok()?).copied()
}

/// Whether an answer compares the two gaits.
pub(super) fn is_plain(answer: OrderedAnswer) -> bool {
    matches!(answer, OrderedAnswer::First | OrderedAnswer::Second | OrderedAnswer::NoDifference)
}
