//! The draw: a pure function of the seed, the rater, and what the rater was shown before.

use crate::store::presentations::{Kind, Presentation, Said};
use crate::store::{PresentationId, TrialId};
use crate::studies::balance::comes_first;
use crate::studies::seed::{Purpose, derive};
use sha2::{Digest, Sha256};

/// One in so many presentations repeats an earlier pair.
const REPEAT_ONE_IN: u64 = 10;
/// One in so many shows the same gait twice.
const NULL_ONE_IN: u64 = 20;

/// What is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Drawn {
    /// Why.
    pub kind: Kind,
    /// The trial shown first.
    pub first: TrialId,
    /// The trial shown second.
    pub second: TrialId,
    /// The presentation that it repeats.
    pub repeats: Option<PresentationId>,
}

/// Draws what a rater is shown next. `question`: the newer and the older trial of the pair that the study asks for;
/// `before`: what this rater was shown, in order; `closed`: trials that nobody may be shown; `controls`: whether a control
/// may be drawn.
pub fn draw(
    study_seed: u64,
    rater: &str,
    question: (TrialId, TrialId),
    before: &[Presentation],
    (closed, controls): (&[TrialId], bool),
) -> Drawn {
    let (newer, older) = question;
    let taken_back = before.last().filter(|last| last.answer == Some(Said::Withdrawn));
    // What was taken back comes again, control or not: else taking back would tell which it was.
    if let Some(last) = taken_back.filter(|last| last.kind != Kind::New)
        && !closed.contains(&last.shown_first)
        && !closed.contains(&last.shown_second)
    {
        let (first, second) = last.pair();
        return Drawn { kind: last.kind, first, second, repeats: last.repeats };
    }
    let again = taken_back.is_some_and(|last| [(newer, older), (older, newer)].contains(&last.pair()));
    if controls
        && !again
        && let Some(control) = control(lot(study_seed, rater, before), older, before, closed)
    {
        return control;
    }
    // Only pairs of the study count for the balance: it is their order that must not matter.
    let counts = |shown: &&Presentation| shown.kind == Kind::New && shown.answer != Some(Said::Withdrawn);
    let asked = before.iter().filter(counts).count();
    let seed = study_seed ^ number_of(rater);
    let newer_first = comes_first(derive(seed, Purpose::Presentation, 2 * (asked as u64 / 4) + 1), asked);
    let (first, second) = if newer_first { (newer, older) } else { (older, newer) };
    Drawn { kind: Kind::New, first, second, repeats: None }
}

/// What decides whether the next presentation is a control, and how long it is waited for.
pub(super) fn lot(study_seed: u64, rater: &str, before: &[Presentation]) -> u64 {
    derive(study_seed ^ number_of(rater), Purpose::Presentation, 2 * before.len() as u64)
}

fn control(lot: u64, older: TrialId, before: &[Presentation], closed: &[TrialId]) -> Option<Drawn> {
    if lot.is_multiple_of(REPEAT_ONE_IN)
        && let Some(earlier) = repeatable(before, closed, lot / REPEAT_ONE_IN)
    {
        return Some(Drawn {
            kind: Kind::Repeat,
            first: earlier.shown_second,
            second: earlier.shown_first,
            repeats: Some(earlier.id),
        });
    }
    let null = Drawn { kind: Kind::Null, first: older, second: older, repeats: None };
    (lot % NULL_ONE_IN == 1).then_some(null)
}

/// An earlier pair with a plain answer that was not repeated yet.
fn repeatable<'a>(before: &'a [Presentation], closed: &[TrialId], lot: u64) -> Option<&'a Presentation> {
    let plain = |shown: &&Presentation| {
        shown.kind == Kind::New
            && matches!(shown.answer, Some(Said::First | Said::Second | Said::NoDifference))
            && !closed.contains(&shown.shown_first)
            && !closed.contains(&shown.shown_second)
            && !before.iter().any(|other| other.repeats == Some(shown.id))
    };
    let candidates: Vec<&Presentation> = before.iter().filter(plain).collect();
    let index = lot.checked_rem(candidates.len() as u64)?;
    candidates.get(usize::try_from(index).ok()?).copied()
}

fn number_of(rater: &str) -> u64 {
    let digest = Sha256::digest(rater.as_bytes());
    digest.iter().take(8).fold(0, |number, byte| (number << 8) | u64::from(*byte))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{StudyId, now};

    fn shown(number: u32, drawn: Drawn) -> Presentation {
        Presentation {
            id: PresentationId::fresh(),
            token: String::new(),
            study_id: StudyId::fresh(),
            rater: "R".to_owned(),
            number,
            kind: drawn.kind,
            shown_first: drawn.first,
            shown_second: drawn.second,
            repeats: drawn.repeats,
            unblinded: false,
            created_at: now(),
            answer: Some(Said::First),
            answered_at: Some(now()),
        }
    }

    #[test]
    fn orders_are_balanced_in_every_block_and_controls_appear_as_often_as_meant() {
        for seed in 0..20 {
            let mut before = Vec::new();
            let mut newer_first = Vec::new();
            for number in 1..=400 {
                let (newer, older) = (TrialId::fresh(), TrialId::fresh());
                let drawn = draw(seed, "R", (newer, older), &before, (&[], true));
                if drawn.kind == Kind::New {
                    newer_first.push(drawn.first == newer);
                }
                before.push(shown(number, drawn));
            }
            for block in newer_first.chunks_exact(4) {
                assert_eq!(block.iter().filter(|first| **first).count(), 2);
            }
            let count = |kind| before.iter().filter(|shown| shown.kind == kind).count();
            assert!((15..=70).contains(&count(Kind::Repeat)), "{}", count(Kind::Repeat));
            assert!((5..=45).contains(&count(Kind::Null)), "{}", count(Kind::Null));
        }
    }

    #[test]
    fn a_repeat_shows_an_earlier_pair_once_with_sides_swapped() {
        let mut before: Vec<Presentation> = Vec::new();
        for number in 1..=300 {
            let drawn = draw(7, "R", (TrialId::fresh(), TrialId::fresh()), &before, (&[], true));
            if let Some(repeats) = drawn.repeats {
                let earlier = before.iter().find(|shown| shown.id == repeats).unwrap();
                assert_eq!((drawn.first, drawn.second), (earlier.shown_second, earlier.shown_first));
                assert!(!before.iter().any(|shown| shown.repeats == Some(repeats)));
            }
            before.push(shown(number, drawn));
        }
    }

    #[test]
    fn what_was_taken_back_comes_again_on_the_same_sides() {
        let mut controls = 0;
        for seed in 0..60 {
            let mut before: Vec<Presentation> = Vec::new();
            for number in 1..=20 {
                let question = (TrialId::fresh(), TrialId::fresh());
                let drawn = draw(seed, "R", question, &before, (&[], true));
                controls += u32::from(drawn.kind != Kind::New);
                before.push(Presentation { answer: Some(Said::Withdrawn), ..shown(number, drawn) });
                let again = draw(seed, "R", question, &before, (&[], true));
                assert_eq!(again, drawn);
                before.push(shown(number, again));
            }
        }
        assert!(controls > 50, "{controls}");
    }

    #[test]
    fn without_a_measured_wait_there_is_no_control() {
        let mut before: Vec<Presentation> = Vec::new();
        for number in 1..=200 {
            let drawn = draw(7, "R", (TrialId::fresh(), TrialId::fresh()), &before, (&[], false));
            assert_eq!(drawn.kind, Kind::New);
            before.push(shown(number, drawn));
        }
    }

    #[test]
    fn the_same_record_gives_the_same_draw_and_raters_differ() {
        let question = (TrialId::fresh(), TrialId::fresh());
        assert_eq!(draw(3, "R", question, &[], (&[], true)), draw(3, "R", question, &[], (&[], true)));
        let firsts: Vec<bool> = (0..40)
            .map(|rater| draw(3, &format!("R{rater}"), question, &[], (&[], true)).first == question.0)
            .collect();
        assert!(firsts.contains(&true) && firsts.contains(&false));
    }

    #[test]
    fn what_was_called_unsafe_is_not_repeated() {
        let drawn = Drawn { kind: Kind::New, first: TrialId::fresh(), second: TrialId::fresh(), repeats: None };
        let before: Vec<Presentation> = (1..=50).map(|number| shown(number, drawn)).collect();
        for seed in 0..50 {
            let drawn = draw(seed, "R", (TrialId::fresh(), TrialId::fresh()), &before, (&[drawn.second], true));
            assert_ne!(drawn.kind, Kind::Repeat);
        }
    }
}
