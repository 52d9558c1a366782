//! Chooses the pair that a rater is shown next, as a pure function of the pending comparison, earlier blind pairs and
//! a random number of the operating system. `store::allocations` draws the sides.

use gaitwright_store::blind_pairs::{BlindPair, BlindPairKind, Judgement};
use gaitwright_store::{BlindPairId, TrialId};

/// One in this many blind pairs repeats an earlier pair.
const REPEAT_ONE_IN: u64 = 10;

/// The chosen pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Drawn {
    /// Why it is shown.
    pub kind: BlindPairKind,
    /// The two gaits, the newer one first.
    pub pair: (TrialId, TrialId),
    /// The earlier pair that it repeats.
    pub repeats: Option<BlindPairId>,
    /// The pair whose answer was retracted: it is shown again, with the same sides.
    pub again: Option<BlindPairId>,
}

/// Chooses what a rater is shown next. `question` is the pending comparison, the newer trial first; `before` lists the
/// earlier blind_pairs of this rater; `reported` lists trials with a safety report in force.
pub fn draw(lot: u64, question: (TrialId, TrialId), before: &[BlindPair], reported: &[TrialId]) -> Drawn {
    let retracted = before.last().filter(|last| last.answer == Some(Judgement::Retracted));
    if let Some(last) = retracted.filter(|last| !last.has_one_of(reported)) {
        // A rater who confused the sides must find them unchanged.
        let again = Drawn { kind: last.kind, pair: last.trials(), repeats: last.repeats, again: Some(last.id) };
        let is_question = is_same_pair(last.trials(), question);
        if last.kind == BlindPairKind::Repeat || is_question {
            return again;
        }
    }
    let new = Drawn { kind: BlindPairKind::New, pair: question, repeats: None, again: None };
    if !lot.is_multiple_of(REPEAT_ONE_IN) {
        return new;
    }
    let repeat = |earlier: &BlindPair| Drawn {
        kind: BlindPairKind::Repeat,
        pair: earlier.trials(),
        repeats: Some(earlier.id),
        again: None,
    };
    repeatable(before, reported, lot / REPEAT_ONE_IN).map_or(new, repeat)
}

/// An earlier pair with a plain answer that has not been repeated.
fn repeatable<'a>(before: &'a [BlindPair], reported: &[TrialId], lot: u64) -> Option<&'a BlindPair> {
    let plain = |shown: &&BlindPair| {
        shown.kind == BlindPairKind::New
            && shown.answer.is_some_and(is_plain)
            && !shown.has_one_of(reported)
            && !before.iter().any(|other| other.repeats == Some(shown.id))
    };
    let candidates: Vec<&BlindPair> = before.iter().filter(plain).collect();
    let index = lot.checked_rem(candidates.len() as u64)?;
    candidates.get(usize::try_from(index).ok()?).copied()
}

/// Whether an answer compares the two gaits.
pub(super) fn is_plain(judgement: Judgement) -> bool {
    matches!(judgement, Judgement::First | Judgement::Second | Judgement::NoDifference)
}

/// Whether two pairs have the same gaits.
pub(super) fn is_same_pair((a, b): (TrialId, TrialId), other: (TrialId, TrialId)) -> bool {
    other == (a, b) || other == (b, a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gaitwright_store::{StudyId, now};

    fn shown(number: u32, drawn: Drawn) -> BlindPair {
        BlindPair {
            id: BlindPairId::fresh(),
            token: String::new(),
            study_id: StudyId::fresh(),
            rater: "R".to_owned(),
            number,
            kind: drawn.kind,
            trial_a: drawn.pair.0,
            trial_b: drawn.pair.1,
            repeats: drawn.repeats,
            could_have_known: false,
            created_at: now(),
            answer: Some(Judgement::First),
            answered_at: Some(now()),
            note: String::new(),
        }
    }

    fn question() -> (TrialId, TrialId) {
        (TrialId::fresh(), TrialId::fresh())
    }

    #[test]
    fn one_pair_in_ten_repeats_an_earlier_one() {
        let mut before: Vec<BlindPair> = Vec::new();
        for number in 1..=400 {
            let drawn = draw(u64::from(number) * 7, question(), &before, &[]);
            if let Some(repeats) = drawn.repeats {
                let earlier = before.iter().find(|shown| shown.id == repeats).unwrap();
                assert_eq!((drawn.kind, drawn.pair), (BlindPairKind::Repeat, earlier.trials()));
                assert!(!before.iter().any(|shown| shown.repeats == Some(repeats)));
            }
            before.push(shown(number, drawn));
        }
        let repeats = before.iter().filter(|shown| shown.kind == BlindPairKind::Repeat).count();
        assert_eq!(repeats, 40);
    }

    #[test]
    fn pair_with_retracted_answer_is_shown_again_with_the_same_sides() {
        for lot in [1, 10] {
            let asked = question();
            let earlier = shown(1, draw(1, question(), &[], &[]));
            let drawn = draw(lot, asked, std::slice::from_ref(&earlier), &[]);
            let retracted = BlindPair { answer: Some(Judgement::Retracted), ..shown(2, drawn) };
            let id = retracted.id;
            let again = draw(3, asked, &[earlier, retracted], &[]);
            assert_eq!(again, Drawn { again: Some(id), ..drawn });
        }
    }

    #[test]
    fn settled_comparison_is_not_shown_again() {
        let retracted = BlindPair { answer: Some(Judgement::Retracted), ..shown(1, draw(1, question(), &[], &[])) };
        let asked = question();
        assert_eq!(draw(1, asked, &[retracted], &[]).pair, asked);
    }

    #[test]
    fn unsafe_gaits_are_not_repeated() {
        let drawn = draw(1, question(), &[], &[]);
        let before: Vec<BlindPair> = (1..=50).map(|number| shown(number, drawn)).collect();
        for lot in 0..50 {
            assert_eq!(draw(10 * lot, question(), &before, &[drawn.pair.1]).kind, BlindPairKind::New);
        }
    }
}
