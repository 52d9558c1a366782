//! Chooses the pair that a rater is shown next, as a pure function of the pending comparison, earlier presentations and
//! a random number of the operating system. `store::allocations` draws the sides.

use gaitwright_store::presentations::{Judgement, Presentation, PresentationKind};
use gaitwright_store::{PresentationId, TrialId};

/// One in this many presentations repeats an earlier pair.
const REPEAT_ONE_IN: u64 = 10;

/// The chosen pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NextPair {
    /// Why it is shown.
    pub kind: PresentationKind,
    /// The two gaits, the newer one first.
    pub pair: (TrialId, TrialId),
    /// The earlier presentation that it repeats.
    pub repeats: Option<PresentationId>,
    /// The presentation whose answer was retracted: the pair is shown again, with the same sides.
    pub same_sides_as: Option<PresentationId>,
}

/// Chooses what a rater is shown next. `question` is the pending comparison, the newer trial first; `before` lists the
/// earlier presentations of this rater; `reported` lists trials with a safety report in force.
pub fn next_pair(random: u64, question: (TrialId, TrialId), before: &[Presentation], reported: &[TrialId]) -> NextPair {
    let retracted =
        before.last().filter(|last| last.answer == Some(Judgement::Retracted) && last.kind != PresentationKind::Null);
    if let Some(last) = retracted.filter(|last| !last.has_one_of(reported)) {
        // A rater who confused the sides must find them unchanged.
        let repeated =
            NextPair { kind: last.kind, pair: last.pair(), repeats: last.repeats, same_sides_as: Some(last.id) };
        let is_question = is_same_pair(last.pair(), question);
        if last.kind == PresentationKind::Repeat || is_question {
            return repeated;
        }
    }
    let new = NextPair { kind: PresentationKind::New, pair: question, repeats: None, same_sides_as: None };
    if !random.is_multiple_of(REPEAT_ONE_IN) {
        return new;
    }
    let repeat = |earlier: &Presentation| NextPair {
        kind: PresentationKind::Repeat,
        pair: earlier.pair(),
        repeats: Some(earlier.id),
        same_sides_as: None,
    };
    repeatable(before, reported, random / REPEAT_ONE_IN).map_or(new, repeat)
}

/// An earlier pair with a plain answer that has not been repeated.
fn repeatable<'a>(before: &'a [Presentation], reported: &[TrialId], random: u64) -> Option<&'a Presentation> {
    let plain = |shown: &&Presentation| {
        shown.kind == PresentationKind::New
            && shown.answer.is_some_and(is_plain)
            && !shown.has_one_of(reported)
            && !before.iter().any(|other| other.repeats == Some(shown.id))
    };
    let candidates: Vec<&Presentation> = before.iter().filter(plain).collect();
    let index = random.checked_rem(candidates.len() as u64)?;
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

    fn shown(number: u32, next: NextPair) -> Presentation {
        Presentation {
            id: PresentationId::fresh(),
            token: String::new(),
            study_id: StudyId::fresh(),
            rater: "R".to_owned(),
            number,
            kind: next.kind,
            one: next.pair.0,
            other: next.pair.1,
            repeats: next.repeats,
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
    fn one_presentation_in_ten_repeats_an_earlier_pair_once() {
        let mut before: Vec<Presentation> = Vec::new();
        for number in 1..=400 {
            let next = next_pair(u64::from(number) * 7, question(), &before, &[]);
            if let Some(repeats) = next.repeats {
                let earlier = before.iter().find(|shown| shown.id == repeats).unwrap();
                assert_eq!((next.kind, next.pair), (PresentationKind::Repeat, earlier.pair()));
                assert!(!before.iter().any(|shown| shown.repeats == Some(repeats)));
            }
            before.push(shown(number, next));
        }
        let repeats = before.iter().filter(|shown| shown.kind == PresentationKind::Repeat).count();
        assert_eq!(repeats, 40);
        assert!(before.iter().all(|shown| shown.kind != PresentationKind::Null));
    }

    #[test]
    fn pair_with_retracted_answer_is_shown_again_with_the_same_sides() {
        for random in [1, 10] {
            let pending = question();
            let earlier = shown(1, next_pair(1, question(), &[], &[]));
            let next = next_pair(random, pending, std::slice::from_ref(&earlier), &[]);
            let retracted = Presentation { answer: Some(Judgement::Retracted), ..shown(2, next) };
            let id = retracted.id;
            let repeated = next_pair(3, pending, &[earlier, retracted], &[]);
            assert_eq!(repeated, NextPair { same_sides_as: Some(id), ..next });
        }
    }

    #[test]
    fn settled_comparison_is_not_shown_again() {
        let retracted =
            Presentation { answer: Some(Judgement::Retracted), ..shown(1, next_pair(1, question(), &[], &[])) };
        let pending = question();
        assert_eq!(next_pair(1, pending, &[retracted], &[]).pair, pending);
    }

    #[test]
    fn unsafe_gaits_are_not_repeated() {
        let next = next_pair(1, question(), &[], &[]);
        let before: Vec<Presentation> = (1..=50).map(|number| shown(number, next)).collect();
        for random in 0..50 {
            assert_eq!(next_pair(10 * random, question(), &before, &[next.pair.1]).kind, PresentationKind::New);
        }
    }
}
