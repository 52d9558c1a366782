//! How far a rater can be relied on: agreement with itself, position bias, and how many answers were not blind.

use super::draw::{is_plain, is_same_pair};
use gaitwright_store::allocations::Sided;
use gaitwright_store::presentations::{Judgement, Kind, Presentation};
use serde::Serialize;
use utoipa::ToSchema;

/// A share of so many, with its 95 % interval (Wilson).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Share {
    /// Of so many.
    pub of: u32,
    /// So many.
    pub count: u32,
    /// The share.
    pub share: Option<f64>,
    /// Lower end of the interval.
    pub low: Option<f64>,
    /// Upper end of the interval.
    pub high: Option<f64>,
}

impl Share {
    /// `count` of `of`.
    pub fn new(count: u32, of: u32) -> Self {
        if of == 0 {
            return Self { of, count, share: None, low: None, high: None };
        }
        let (n, p, z) = (f64::from(of), f64::from(count) / f64::from(of), 1.959_963_984_540_054_f64);
        let centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        let (low, high) = ((centre - half).max(0.0), (centre + half).min(1.0));
        Self { of, count, share: Some(p), low: Some(low), high: Some(high) }
    }
}

/// What is known of a rater in a study.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RaterFigures {
    /// Who.
    pub rater: String,
    /// How many presentations were drawn.
    pub shown: u32,
    /// How many were answered.
    pub answered: u32,
    /// Of the blind answers with a preference, those that preferred the gait shown first: far from a half is position bias.
    /// None until the rater is unblinded, because it would tell the order of pairs.
    pub first_preferred: Option<Share>,
    /// Of the pairs that were answered blindly once more, those answered as the time before.
    pub repeats_agree: Share,
    /// Answers "cannot tell".
    pub cannot_tell: u32,
    /// Answers that called a gait unsafe.
    pub unsafe_gaits: u32,
    /// Presentations of which the rater could have known which gait is which. The shares leave them out.
    pub unblinded: u32,
}

/// The figures of every rater of a study, by name. `sides`: the pairs of the raters who were unblinded.
pub fn figures(presentations: &[Presentation], sides: &[Sided]) -> Vec<RaterFigures> {
    let mut raters: Vec<&str> = presentations.iter().map(|shown| shown.rater.as_str()).collect();
    raters.sort_unstable();
    raters.dedup();
    raters.into_iter().map(|rater| of_rater(rater, presentations, sides)).collect()
}

fn of_rater(rater: &str, all: &[Presentation], sides: &[Sided]) -> RaterFigures {
    let own: Vec<&Presentation> = all.iter().filter(|shown| shown.rater == rater).collect();
    let count = |wanted: &dyn Fn(&Presentation) -> bool| {
        u32::try_from(own.iter().filter(|shown| wanted(shown)).count()).unwrap_or(u32::MAX)
    };
    let is_unsafe = |shown: &Presentation| shown.answer.is_some_and(Judgement::is_about_safety);
    RaterFigures {
        rater: rater.to_owned(),
        shown: count(&|_| true),
        answered: count(&|shown| shown.answer.is_some_and(|said| said != Judgement::Withdrawn)),
        first_preferred: first_preferred(rater, sides),
        repeats_agree: repeats_agree(&own),
        cannot_tell: count(&|s| s.answer == Some(Judgement::CannotTell)),
        unsafe_gaits: count(&is_unsafe),
        unblinded: count(&|s| s.unblinded),
    }
}

fn first_preferred(rater: &str, sides: &[Sided]) -> Option<Share> {
    let mut own = sides.iter().filter(|sided| sided.presentation.rater == rater).peekable();
    own.peek()?;
    let blind = own.filter(|sided| !sided.presentation.unblinded && sided.presentation.kind != Kind::Null);
    let answers: Vec<Judgement> = blind.filter_map(Sided::answer).collect();
    let count = |said| u32::try_from(answers.iter().filter(|answer| **answer == said).count()).unwrap_or(u32::MAX);
    let (first, second) = (count(Judgement::First), count(Judgement::Second));
    Some(Share::new(first, first.saturating_add(second)))
}

/// Each plain answer beside the one before to the same two gaits.
fn repeats_agree(own: &[&Presentation]) -> Share {
    let plain =
        |shown: &&Presentation| !shown.unblinded && shown.kind != Kind::Null && shown.answer.is_some_and(is_plain);
    let answered: Vec<&Presentation> = own.iter().copied().filter(plain).collect();
    let (mut agree, mut of) = (0_u32, 0_u32);
    for (place, shown) in answered.iter().enumerate() {
        let before = answered[..place].iter().rfind(|other| is_same_pair(other.pair(), shown.pair()));
        let Some(before) = before else { continue };
        let turned = if before.pair() == shown.pair() { before.answer } else { before.answer.map(Judgement::swapped) };
        of += 1;
        agree += u32::from(turned == shown.answer);
    }
    Share::new(agree, of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_wilson() {
        // Wilson 1927; 8 of 10: 0.490 to 0.943.
        let share = Share::new(8, 10);
        assert!((share.low.unwrap() - 0.4902).abs() < 1e-3, "{share:?}");
        assert!((share.high.unwrap() - 0.9433).abs() < 1e-3, "{share:?}");
        assert_eq!(Share::new(0, 0).share, None);
        assert_eq!(Share::new(0, 5).low, Some(0.0));
    }
}
