//! How long the next pair is held back after a control.
//!
//! After an answer to a question the study solves, and the next pair comes when that is done. A control leaves its
//! question open: were the next pair shown at once, a watch would tell controls from questions. So it is held for a time
//! drawn from the waits after questions of the same study; where none was measured yet, no control is drawn.

use crate::store::Instant;
use crate::store::presentations::{Kind, Presentation, Said};
use std::time::Duration;

/// Waits longer than so many times the median are left out: a study that was paused, a machine that was switched off.
const LONGEST_MEDIANS: f64 = 4.0;
/// A wait is drawn out or shortened by up to so much: a time that comes again to the second would tell, too.
const SPREAD: f64 = 0.25;

/// The waits after questions, s: from an answer until the study could ask again, in order of length. `converged`: when the
/// gaits of the study were found.
pub(super) fn waits(presentations: &[Presentation], converged: &[Instant]) -> Vec<f64> {
    let asked = || presentations.iter().filter(|shown| shown.kind == Kind::New);
    let wait = |shown: &Presentation| {
        let answered = shown.answered_at.filter(|_| shown.answer != Some(Said::Withdrawn))?;
        // A study that asks several questions about one gait has the next one at once.
        let drawn = asked().map(|other| other.created_at);
        let next = drawn.chain(converged.iter().copied()).filter(|at| *at > answered).min()?;
        Some(next.seconds_since(answered))
    };
    let mut waits: Vec<f64> = asked().filter_map(wait).collect();
    waits.sort_by(f64::total_cmp);
    if let Some(&median) = waits.get(waits.len() / 2) {
        waits.retain(|wait| *wait <= LONGEST_MEDIANS * median);
    }
    waits
}

/// Until when a rater whose last pair was `last` is shown nothing; `lot` decides among the waits.
pub(super) fn until(last: Option<&Presentation>, waits: &[f64], lot: u64) -> Option<Instant> {
    let last = last.filter(|last| last.kind != Kind::New && last.answer != Some(Said::Withdrawn))?;
    let answered = last.answered_at?;
    let wait = waits.get(usize::try_from(lot % waits.len().max(1) as u64).ok()?)?;
    let share = (lot / 1009 % 1000) as f64 / 999.0;
    let factor = 1.0 - SPREAD + 2.0 * SPREAD * share;
    Some(answered.after(Duration::from_secs_f64((wait * factor).max(0.0))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{PresentationId, StudyId, TrialId, now};

    fn shown(kind: Kind, created_at: Instant, answered: Option<(Said, Instant)>) -> Presentation {
        Presentation {
            id: PresentationId::fresh(),
            token: String::new(),
            study_id: StudyId::fresh(),
            rater: "R".to_owned(),
            number: 1,
            kind,
            shown_first: TrialId::fresh(),
            shown_second: TrialId::fresh(),
            repeats: None,
            unblinded: false,
            created_at,
            answer: answered.map(|(said, _)| said),
            answered_at: answered.map(|(_, at)| at),
        }
    }

    #[test]
    fn waits_end_with_the_next_gait_or_the_next_question() {
        let start = now();
        let at = |seconds| start.plus_seconds(seconds);
        let said = |seconds| Some((Said::First, at(seconds)));
        let presentations = [
            shown(Kind::New, at(0), said(10)),
            // Asked at once: a second question about the same gait.
            shown(Kind::New, at(12), said(20)),
            shown(Kind::Null, at(21), said(22)),
            shown(Kind::New, at(40), Some((Said::Withdrawn, at(45)))),
            shown(Kind::New, at(46), said(50)),
            shown(Kind::New, at(90), said(100)),
        ];
        let converged = [at(5), at(28), at(57), at(900)];
        assert_eq!(waits(&presentations, &converged), [2.0, 7.0, 8.0]);
        assert!(waits(&presentations[..1], &converged[..1]).is_empty());
    }

    #[test]
    fn after_a_control_the_next_pair_comes_about_as_late_as_after_a_question() {
        let start = now();
        let control = shown(Kind::Repeat, start, Some((Said::Second, start.plus_seconds(3))));
        let held = |lot| until(Some(&control), &[4.0, 8.0], lot).unwrap().seconds_since(start) - 3.0;
        let all: Vec<f64> = (0..2000).map(|lot| held(lot * 977)).collect();
        let (least, most) = all.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), held| (a.min(*held), b.max(*held)));
        assert!((3.0..3.2).contains(&least) && (9.8..=10.0).contains(&most), "{least} {most}");
        assert_eq!(held(7).to_bits(), held(7).to_bits());
        let question = shown(Kind::New, start, Some((Said::Second, start)));
        let taken_back = shown(Kind::Null, start, Some((Said::Withdrawn, start)));
        assert_eq!(until(Some(&question), &[4.0], 1), None);
        assert_eq!(until(Some(&taken_back), &[4.0], 1), None);
        assert_eq!(until(Some(&control), &[], 1), None);
        assert_eq!(until(None, &[4.0], 1), None);
    }
}
