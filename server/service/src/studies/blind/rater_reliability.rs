//! Reliability of raters: agreement with their own earlier answers, position bias, and unblinded answers.

use super::next_pair::is_same_pair;
use super::repeated_pair::is_plain;
use crate::error::Error;
use gaitwright_store::allocations::{self, PairWithSides};
use gaitwright_store::blind_pairs::{self, BlindPair, OrderedAnswer};
use gaitwright_store::{Connection, StudyId};
use serde::Serialize;
use utoipa::ToSchema;

/// A proportion with its 95 % confidence interval (Wilson).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[schema(as = Proportion)]
pub struct Share {
    /// Number of cases.
    pub of: u32,
    /// Number of successes.
    pub count: u32,
    /// `count / of`.
    pub share: Option<f64>,
    /// Lower bound of the interval.
    pub low: Option<f64>,
    /// Upper bound of the interval.
    pub high: Option<f64>,
}

impl Share {
    /// The proportion `count / of`.
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

/// Reliability of a rater in a study.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RaterReliability {
    /// Name of the rater.
    pub rater: String,
    /// Number of blind pairs.
    pub shown: u32,
    /// Number of answers.
    pub answered: u32,
    /// Share of blind preferences for the gait shown first. A value far from one half indicates position bias. Null
    /// until the rater is unblinded, because it would reveal allocations.
    pub first_preferred: Option<Share>,
    /// Share of repeated pairs with the same answer as before, among blind answers.
    pub repeats_agree: Share,
    /// Number of "cannot tell" answers.
    pub cannot_tell: u32,
    /// Number of answers that reported a gait as unsafe.
    pub unsafe_gaits: u32,
    /// Number of blind pairs in which the rater could have known the allocation. The shares exclude them.
    pub could_have_known: u32,
}

/// The reliability of every rater of a study, by name.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId) -> Result<Vec<RaterReliability>, Error> {
    let shown = blind_pairs::of_study(db, study).await?;
    let sides = allocations::of_unblinded_raters(db, study).await?;
    Ok(reliability(&shown, &sides))
}

/// The reliability of every rater of a study, by name. `sides` has the allocations of unblinded raters.
fn reliability(pairs: &[BlindPair], sides: &[PairWithSides]) -> Vec<RaterReliability> {
    let mut raters: Vec<&str> = pairs.iter().map(|shown| shown.rater.as_str()).collect();
    raters.sort_unstable();
    raters.dedup();
    raters.into_iter().map(|rater| of_rater(rater, pairs, sides)).collect()
}

fn of_rater(rater: &str, all: &[BlindPair], sides: &[PairWithSides]) -> RaterReliability {
    let own: Vec<&BlindPair> = all.iter().filter(|shown| shown.rater == rater).collect();
    let count = |wanted: &dyn Fn(&BlindPair) -> bool| {
        u32::try_from(own.iter().filter(|shown| wanted(shown)).count()).unwrap_or(u32::MAX)
    };
    let is_unsafe = |shown: &BlindPair| shown.answer.is_some_and(OrderedAnswer::is_about_safety);
    RaterReliability {
        rater: rater.to_owned(),
        shown: count(&|_| true),
        answered: count(&|shown| shown.answer.is_some_and(|answer| answer != OrderedAnswer::Retracted)),
        first_preferred: first_preferred(rater, sides),
        repeats_agree: repeats_agree(&own),
        cannot_tell: count(&|s| s.answer == Some(OrderedAnswer::CannotTell)),
        unsafe_gaits: count(&is_unsafe),
        could_have_known: count(&|s| s.could_have_known),
    }
}

fn first_preferred(rater: &str, sides: &[PairWithSides]) -> Option<Share> {
    let mut own = sides.iter().filter(|sided| sided.pair.rater == rater).peekable();
    own.peek()?;
    let blind = own.filter(|sided| !sided.pair.could_have_known);
    let answers: Vec<OrderedAnswer> = blind.filter_map(PairWithSides::answer).collect();
    let count = |wanted| u32::try_from(answers.iter().filter(|answer| **answer == wanted).count()).unwrap_or(u32::MAX);
    let (first, second) = (count(OrderedAnswer::First), count(OrderedAnswer::Second));
    Some(Share::new(first, first.saturating_add(second)))
}

/// Compares each plain answer with the previous one to the same pair.
fn repeats_agree(own: &[&BlindPair]) -> Share {
    let plain = |shown: &&BlindPair| !shown.could_have_known && shown.answer.is_some_and(is_plain);
    let answered: Vec<&BlindPair> = own.iter().copied().filter(plain).collect();
    let (mut agree, mut of) = (0_u32, 0_u32);
    for (place, shown) in answered.iter().enumerate() {
        let before = answered[..place].iter().rfind(|other| is_same_pair(other.trials(), shown.trials()));
        let Some(before) = before else { continue };
        let turned =
            if before.trials() == shown.trials() { before.answer } else { before.answer.map(OrderedAnswer::swapped) };
        of += 1;
        agree += u32::from(turned == shown.answer);
    }
    Share::new(agree, of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_match_wilsons_formula() {
        // Wilson 1927; 8 of 10: 0.490 to 0.943.
        let share = Share::new(8, 10);
        assert!((share.low.unwrap() - 0.4902).abs() < 1e-3, "{share:?}");
        assert!((share.high.unwrap() - 0.9433).abs() < 1e-3, "{share:?}");
        assert_eq!(Share::new(0, 0).share, None);
        assert_eq!(Share::new(0, 5).low, Some(0.0));
    }
}
