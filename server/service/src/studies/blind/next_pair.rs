//! Chooses the pair that a rater is shown next, as a pure function of the pending comparison, earlier blind pairs and
//! a random number of the operating system. `store::allocations` draws the sides.

use super::repeated_pair::repeated_pair;
use gaitwright_store::blind_pairs::{BlindPair, BlindPairKind, OrderedAnswer};
use gaitwright_store::{BlindPairId, TrialId};

/// The chosen pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NextPair {
    /// Why it is shown.
    pub kind: BlindPairKind,
    /// The two gaits, the newer one first.
    pub pair: (TrialId, TrialId),
    /// The earlier pair that it repeats.
    pub repeats: Option<BlindPairId>,
    /// The pair whose answer was retracted: it is shown again, with the same sides.
    pub same_sides_as: Option<BlindPairId>,
}

/// Chooses what a rater is shown next. `pending` is the pending comparison, the newer trial first; `before` lists the
/// earlier blind pairs of this rater; `reported` lists trials with a safety report in force.
pub fn next_pair(random: u64, pending: (TrialId, TrialId), before: &[BlindPair], reported: &[TrialId]) -> NextPair {
    let retracted = before.last().filter(|last| last.answer == Some(OrderedAnswer::Retracted));
    if let Some(last) = retracted.filter(|last| !last.has_one_of(reported)) {
        // A rater who confused the sides must find them unchanged.
        let repeated =
            NextPair { kind: last.kind, pair: last.trials(), repeats: last.repeats, same_sides_as: Some(last.id) };
        let is_pending = is_same_pair(last.trials(), pending);
        if last.kind == BlindPairKind::Repeat || is_pending {
            return repeated;
        }
    }
    let new = NextPair { kind: BlindPairKind::New, pair: pending, repeats: None, same_sides_as: None };
    let repeat = |earlier: &BlindPair| NextPair {
        kind: BlindPairKind::Repeat,
        pair: earlier.trials(),
        repeats: Some(earlier.id),
        same_sides_as: None,
    };
    repeated_pair(random, before, reported).map_or(new, repeat)
}

/// Whether two pairs have the same gaits.
pub(super) fn is_same_pair((a, b): (TrialId, TrialId), other: (TrialId, TrialId)) -> bool {
    other == (a, b) || other == (b, a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gaitwright_store::{StudyId, now};

    fn shown(number: u32, next: NextPair) -> BlindPair {
        BlindPair {
            id: BlindPairId::fresh(),
            code: String::new(),
            study_id: StudyId::fresh(),
            rater: "R".to_owned(),
            number,
            kind: next.kind,
            trial_a: next.pair.0,
            trial_b: next.pair.1,
            repeats: next.repeats,
            could_have_known: false,
            created_at: now(),
            answer: Some(OrderedAnswer::First),
            answered_at: Some(now()),
            note: String::new(),
        }
    }

    fn pending_pair() -> (TrialId, TrialId) {
        (TrialId::fresh(), TrialId::fresh())
    }

    #[test]
    fn one_pair_in_ten_repeats_an_earlier_one() {
        let mut before: Vec<BlindPair> = Vec::new();
        for number in 1..=400 {
            let next = next_pair(u64::from(number) * 7, pending_pair(), &before, &[]);
            if let Some(repeats) = next.repeats {
                let earlier = before.iter().find(|shown| shown.id == repeats).unwrap();
                assert_eq!((next.kind, next.pair), (BlindPairKind::Repeat, earlier.trials()));
                assert!(!before.iter().any(|shown| shown.repeats == Some(repeats)));
            }
            before.push(shown(number, next));
        }
        let repeats = before.iter().filter(|shown| shown.kind == BlindPairKind::Repeat).count();
        assert_eq!(repeats, 40);
    }

    #[test]
    fn pair_with_retracted_answer_is_shown_again_with_the_same_sides() {
        for random in [1, 10] {
            let pending = pending_pair();
            let earlier = shown(1, next_pair(1, pending_pair(), &[], &[]));
            let next = next_pair(random, pending, std::slice::from_ref(&earlier), &[]);
            let retracted = BlindPair { answer: Some(OrderedAnswer::Retracted), ..shown(2, next) };
            let id = retracted.id;
            let repeated = next_pair(3, pending, &[earlier, retracted], &[]);
            assert_eq!(repeated, NextPair { same_sides_as: Some(id), ..next });
        }
    }

    #[test]
    fn settled_comparison_is_not_shown_again() {
        let retracted =
            BlindPair { answer: Some(OrderedAnswer::Retracted), ..shown(1, next_pair(1, pending_pair(), &[], &[])) };
        let pending = pending_pair();
        assert_eq!(next_pair(1, pending, &[retracted], &[]).pair, pending);
    }

    #[test]
    fn unsafe_gaits_are_not_repeated() {
        let next = next_pair(1, pending_pair(), &[], &[]);
        let before: Vec<BlindPair> = (1..=50).map(|number| shown(number, next)).collect();
        for random in 0..50 {
            assert_eq!(next_pair(10 * random, pending_pair(), &before, &[next.pair.1]).kind, BlindPairKind::New);
        }
    }
}
