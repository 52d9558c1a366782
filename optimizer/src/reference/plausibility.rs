//! Plausibility of a mean stride: impossible curves are errors, unusual ones give a warning.

use super::reference_gait::{REFERENCE_COLUMNS, ReferenceGait};
use crate::model_error::ModelError;
use crate::statistics::{average, correlation, extremes};

/// Indices among the angles of a reference gait.
const TORSO: usize = 0;
const KNEE: usize = 2;
const ANKLE: usize = 3;
/// Largest magnitude of the mean torso lean, degrees.
const MAX_LEAN_DEG: f64 = 45.0;
/// Smallest peak of knee flexion, degrees. Nearly straight swing legs reach 30.
const MIN_KNEE_PEAK_DEG: f64 = 20.0;
/// Largest minimum of knee flexion, degrees.
const MAX_LEAST_FLEXION_DEG: f64 = 40.0;
/// Largest magnitude of the mean ankle angle, degrees.
const MAX_ANKLE_MEAN_DEG: f64 = 30.0;
/// Smallest range of motion of the ankle, degrees. Radians taken for degrees give about 0.5.
const MIN_ANKLE_RANGE_DEG: f64 = 2.0;
/// Curves that are compared with the built-in reference gait. The shape of the torso curve differs between people.
const COMPARED: [(usize, &str); 4] = [(1, "left hip"), (KNEE, "left knee"), (ANKLE, "left ankle"), (4, "right hip")];
/// Smallest usual correlation with the built-in curves. Means of 24 young adults reach 0.88 or more, ankles of single
/// strides 0.7; a shift by a tenth of a stride gives 0.4 for the ankle.
const MIN_CORRELATION: f64 = 0.5;

/// The reason why a mean stride is impossible, if any.
pub(super) fn why_implausible(mean: &[[f64; 5]]) -> Option<String> {
    torso(&curve(mean, TORSO))
        .map(|reason| (TORSO, reason))
        .or_else(|| knee(&curve(mean, KNEE)).map(|reason| (KNEE, reason)))
        .or_else(|| ankle(&curve(mean, ANKLE)).map(|reason| (ANKLE, reason)))
        .map(|(place, reason)| format!("{} {reason}", REFERENCE_COLUMNS[place]))
}

fn torso(degrees: &[f64]) -> Option<String> {
    let lean = average(degrees);
    (lean.abs() > MAX_LEAN_DEG).then(|| {
        let reason = format!(
            "is {lean:.0}° on average over the stride; plausible averages are at most {MAX_LEAN_DEG}° in either direction"
        );
        format!("{reason}; check the sign, and that upright is 0°")
    })
}

fn knee(degrees: &[f64]) -> Option<String> {
    let (least, peak) = extremes(degrees);
    if peak < MIN_KNEE_PEAK_DEG {
        let reason =
            format!("has a peak flexion of only {peak:.1}° in the stride; at least {MIN_KNEE_PEAK_DEG}° is expected");
        return Some(format!("{reason}; check the sign and the unit"));
    }
    (least > MAX_LEAST_FLEXION_DEG).then(|| {
        let straight = format!("its minimum must be at most {MAX_LEAST_FLEXION_DEG}°");
        format!("shows at least {least:.0}° of flexion throughout the stride; {straight}")
    })
}

fn ankle(degrees: &[f64]) -> Option<String> {
    let (lowest, highest) = extremes(degrees);
    let (mean, range) = (average(degrees), highest - lowest);
    if mean.abs() > MAX_ANKLE_MEAN_DEG {
        let reason = format!(
            "is {mean:.0}° on average over the stride; plausible averages are at most {MAX_ANKLE_MEAN_DEG}° in either direction"
        );
        return Some(format!("{reason}; check that the angle is 0° when foot and shank are perpendicular"));
    }
    (range < MIN_ANKLE_RANGE_DEG)
        .then(|| format!("moves by only {range:.2}° in the stride, less than {MIN_ANKLE_RANGE_DEG}°; check the unit"))
}

impl ReferenceGait {
    /// The curves that differ in shape from the built-in reference gait, as a warning.
    ///
    /// # Errors
    /// As [`Self::builtin`].
    pub fn warning(&self) -> Result<Option<String>, ModelError> {
        unlike_builtin(&self.angles_rad)
    }
}

/// A warning if curves differ in shape from those of the built-in reference gait.
pub(super) fn unlike_builtin(mean: &[[f64; 5]]) -> Result<Option<String>, ModelError> {
    let builtin = ReferenceGait::builtin()?.angles_rad;
    let unlike: Vec<String> = COMPARED
        .into_iter()
        .filter_map(|(place, name)| match correlation(&curve(mean, place), &curve(&builtin, place)) {
            Some(correlation) if correlation >= MIN_CORRELATION => None,
            Some(correlation) => {
                // A minus sign, as in every text for people.
                Some(format!("{name} (correlation {:.2})", hundredths(correlation)).replace('-', "\u{2212}"))
            }
            None => Some(format!("{name} (constant)")),
        })
        .collect();
    let warning = || {
        let differ = if unlike.len() == 1 { "differs" } else { "differ" };
        let (curves, check) = (unlike.join(", "), "check the sign, the side and the heel strikes");
        format!("{curves} {differ} in shape from the built-in reference gait; {check}")
    };
    Ok((!unlike.is_empty()).then(warning))
}

/// One angle over the stride, in degrees.
fn curve(mean: &[[f64; 5]], place: usize) -> Vec<f64> {
    mean.iter().map(|row| row[place].to_degrees()).collect()
}

/// Rounds to hundredths, without a negative zero.
fn hundredths(value: f64) -> f64 {
    (100.0 * value).round() / 100.0 + 0.0
}
