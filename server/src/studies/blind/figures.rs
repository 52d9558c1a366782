//! How far a rater can be relied on: agreement with itself, position bias, differences seen where there is none.

use crate::store::presentations::{Kind, Presentation, Said};
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
    /// Of the pairs with a preference, those where the first was preferred: far from a half is position bias.
    pub first_preferred: Share,
    /// Of the repeated pairs, those answered as the first time.
    pub repeats_agree: Share,
    /// Of the pairs of the same gait twice, those answered with no difference.
    pub nulls_without_difference: Share,
    /// Answers "cannot tell".
    pub cannot_tell: u32,
    /// Answers that called a gait unsafe.
    pub unsafe_gaits: u32,
    /// Presentations drawn after the rater was told which is which.
    pub unblinded: u32,
}

/// The figures of every rater of a study, by name.
pub fn figures(presentations: &[Presentation]) -> Vec<RaterFigures> {
    let mut raters: Vec<&str> = presentations.iter().map(|shown| shown.rater.as_str()).collect();
    raters.sort_unstable();
    raters.dedup();
    raters.into_iter().map(|rater| of_rater(rater, presentations)).collect()
}

fn of_rater(rater: &str, all: &[Presentation]) -> RaterFigures {
    let own: Vec<&Presentation> = all.iter().filter(|shown| shown.rater == rater).collect();
    let count = |wanted: &dyn Fn(&Presentation) -> bool| {
        u32::try_from(own.iter().filter(|shown| wanted(shown)).count()).unwrap_or(u32::MAX)
    };
    let preferred = |shown: &Presentation| matches!(shown.answer, Some(Said::First | Said::Second));
    let plain = |shown: &Presentation| preferred(shown) || shown.answer == Some(Said::NoDifference);
    let agrees = |shown: &Presentation| {
        let earlier = own.iter().find(|other| Some(other.id) == shown.repeats);
        earlier.is_some_and(|earlier| swapped(earlier.answer) == shown.answer)
    };
    let is_unsafe = |shown: &Presentation| shown.answer.is_some_and(Said::is_about_safety);
    RaterFigures {
        rater: rater.to_owned(),
        shown: count(&|_| true),
        answered: count(&|shown| shown.answer.is_some_and(|said| said != Said::Withdrawn)),
        first_preferred: Share::new(count(&|s| s.answer == Some(Said::First)), count(&preferred)),
        repeats_agree: Share::new(
            count(&|s| s.kind == Kind::Repeat && plain(s) && agrees(s)),
            count(&|s| s.kind == Kind::Repeat && plain(s)),
        ),
        nulls_without_difference: Share::new(
            count(&|s| s.kind == Kind::Null && s.answer == Some(Said::NoDifference)),
            count(&|s| s.kind == Kind::Null && plain(s)),
        ),
        cannot_tell: count(&|s| s.answer == Some(Said::CannotTell)),
        unsafe_gaits: count(&is_unsafe),
        unblinded: count(&|s| s.unblinded),
    }
}

/// The same answer about a pair with its sides swapped.
fn swapped(answer: Option<Said>) -> Option<Said> {
    match answer {
        Some(Said::First) => Some(Said::Second),
        Some(Said::Second) => Some(Said::First),
        other => other,
    }
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
