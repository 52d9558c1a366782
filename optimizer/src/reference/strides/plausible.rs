//! Whether a mean stride is a walker's: what none does is refused, what is odd is said.

use super::super::REFERENCE_COLUMNS;
use super::{Recording, ReferenceGait};
use crate::subject::ModelError;

/// Places among the reference's angles.
const TRUNK: usize = 0;
const KNEE: usize = 2;
const ANKLE: usize = 3;
/// A trunk leans no more over a stride, either way, degrees.
const LARGEST_LEAN_DEG: f64 = 45.0;
/// A knee that walks bends at least so far once in a stride, degrees: legs that swing nearly straight bend to 30.
const SMALLEST_KNEE_PEAK_DEG: f64 = 20.0;
/// And once it is straighter than this, degrees.
const LARGEST_LEAST_FLEXION_DEG: f64 = 40.0;
/// An ankle is no more bent over a stride, either way, degrees.
const LARGEST_ANKLE_MEAN_DEG: f64 = 30.0;
/// An ankle that walks moves at least over this, degrees: one in radians that is read as degrees does over about half.
const SMALLEST_ANKLE_RANGE_DEG: f64 = 2.0;
/// Curves that are held against the built-in reference, in words. The trunk's has no shape that all walkers share.
const COMPARED: [(usize, &str); 4] = [(1, "left hip"), (KNEE, "left knee"), (ANKLE, "left ankle"), (4, "right hip")];
/// Curves of walkers correlate more with the built-in ones: those of 24 young adults by .88 and more, ankles of single
/// strides by .7; a tenth of a stride too late leaves .4 of the ankle.
const LEAST_CORRELATION: f64 = 0.5;

/// Why this mean stride is no walker's.
pub(super) fn no_walker(mean: &[[f64; 5]]) -> Option<String> {
    trunk(&curve(mean, TRUNK))
        .map(|reason| (TRUNK, reason))
        .or_else(|| knee(&curve(mean, KNEE)).map(|reason| (KNEE, reason)))
        .or_else(|| ankle(&curve(mean, ANKLE)).map(|reason| (ANKLE, reason)))
        .map(|(place, reason)| format!("{} {reason}", REFERENCE_COLUMNS[place]))
}

fn trunk(degrees: &[f64]) -> Option<String> {
    let lean = average(degrees);
    (lean.abs() > LARGEST_LEAN_DEG).then(|| {
        let reason = format!("is {lean:.0}° on average over the stride, beyond {LARGEST_LEAN_DEG}° either way");
        format!("{reason}: are sign and upright right?")
    })
}

fn knee(degrees: &[f64]) -> Option<String> {
    let (least, peak) = Recording::extremes(degrees);
    if peak < SMALLEST_KNEE_PEAK_DEG {
        let reason = format!("never bends beyond {SMALLEST_KNEE_PEAK_DEG}° in the stride, at most to {peak:.1}°");
        return Some(format!("{reason}: are sign and unit right?"));
    }
    (least > LARGEST_LEAST_FLEXION_DEG).then(|| {
        let straight = format!("a knee that walks is below {LARGEST_LEAST_FLEXION_DEG}° once in a stride");
        format!("is never less bent than {least:.0}°, {straight}")
    })
}

fn ankle(degrees: &[f64]) -> Option<String> {
    let (lowest, highest) = Recording::extremes(degrees);
    let (mean, range) = (average(degrees), highest - lowest);
    if mean.abs() > LARGEST_ANKLE_MEAN_DEG {
        let reason = format!("is {mean:.0}° on average over the stride, beyond {LARGEST_ANKLE_MEAN_DEG}° either way");
        return Some(format!("{reason}: is it 0° where foot and shank are at right angles?"));
    }
    (range < SMALLEST_ANKLE_RANGE_DEG).then(|| {
        format!("moves over {range:.2}° only in the stride, less than {SMALLEST_ANKLE_RANGE_DEG}°; is the unit right?")
    })
}

/// What is said of a mean stride whose curves have another shape than those of the built-in reference.
pub(super) fn unlike_builtin(mean: &[[f64; 5]]) -> Result<Option<String>, ModelError> {
    let builtin = ReferenceGait::builtin()?.angles_rad;
    let unlike: Vec<String> = COMPARED
        .into_iter()
        .filter_map(|(place, name)| match ReferenceGait::correlation(&curve(mean, place), &curve(&builtin, place)) {
            Some(correlation) if correlation >= LEAST_CORRELATION => None,
            Some(correlation) => Some(format!("{name} (correlation {:.2})", hundredths(correlation))),
            None => Some(format!("{name} (it does not move)")),
        })
        .collect();
    let remark =
        || format!("unlike the built-in reference: {}: are sign, side and heel strikes right?", unlike.join(", "));
    Ok((!unlike.is_empty()).then(remark))
}

/// One angle over the stride, degrees.
fn curve(mean: &[[f64; 5]], place: usize) -> Vec<f64> {
    mean.iter().map(|row| row[place].to_degrees()).collect()
}

/// Without the sign of a zero.
fn hundredths(value: f64) -> f64 {
    (100.0 * value).round() / 100.0 + 0.0
}

fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

impl ReferenceGait {
    /// Pearson's correlation of two curves over the cycle; none where one of them is constant.
    pub(crate) fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
        let (mean_a, mean_b) = (average(a), average(b));
        let product: f64 = a.iter().zip(b).map(|(x, y)| (x - mean_a) * (y - mean_b)).sum();
        let spread = |values: &[f64], mean: f64| values.iter().map(|v| (v - mean).powi(2)).sum::<f64>().sqrt();
        let both = spread(a, mean_a) * spread(b, mean_b);
        (both > 0.0).then(|| product / both)
    }
}
