//! From a recording to a reference gait: heel strikes, strides of 101 points, mean and standard deviation.

use super::recording::Recording;
use super::{REFERENCE_ROWS, ReferenceGait};
use crate::subject::{ModelError, Subject};
use plausible::{no_walker, unlike_builtin};
use std::ops::Range;

mod plausible;

/// Durations of valid strides, s.
pub const STRIDE_RANGE_S: (f64, f64) = (0.8, 1.6);
/// The error if heel strikes cannot be detected by kinematics.
const NO_KNEE: &str = "the recording has no right knee (column knee_R_rad), which the detection of heel strikes by kinematics needs; \
                       give the times of the right heel strikes, or use a force under the right foot";
/// Longest gap between two rows of a valid stride, s.
const LONGEST_GAP_S: f64 = 0.1;
/// Vertical force above which the foot is in contact, N.
const CONTACT_FORCE_N: f64 = 20.0;
/// Shortest time without contact before a heel strike, s.
const SHORTEST_SWING_S: f64 = 0.1;
/// Shortest contact, s. Noise and vibration of an unloaded plate are shorter.
const SHORTEST_CONTACT_S: f64 = 0.05;
/// Rounding error of a difference of times, s.
const ROUNDING_S: f64 = 1e-9;
/// Half width of the window in which a heel strike by kinematics is the maximum, s.
const NEIGHBOURHOOD_S: f64 = 0.3;
/// Index of the left knee among the angles of a reference gait.
const LEFT_KNEE: usize = 2;
/// Smallest angle by which one thigh is clearly behind the other, rad.
const BEHIND_RAD: f64 = 0.05;
/// Largest plausible excess of knee flexion in stance over that in swing, rad. Some people walk with a nearly straight
/// swing leg.
const STANCE_FLEXION_RAD: f64 = 0.26;
/// Largest number of heel strikes that the provenance lists one by one.
const MANY_STRIKES: usize = 200;
/// Lengths of thigh and shank, in body heights (Winter 2009).
const LEG: [f64; 2] = [0.245, 0.246];

/// Method that determines the right heel strikes.
#[derive(Debug, Clone, PartialEq)]
pub enum HeelStrikes {
    /// Given times, s.
    Given(Vec<f64>),
    /// By force: the vertical force under the right foot rises above 20 N and stays there for at least 50 ms.
    Force,
    /// By kinematics: the right heel is farthest ahead of the pelvis (Zeni et al. 2008, Gait & Posture 27:710).
    Kinematics,
    /// The first and last row: the recording is one stride, such as an exported gait.
    Ends,
}

/// Height and mass of the recorded person, if known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Walker {
    /// Body height, m.
    pub height_m: Option<f64>,
    /// Body mass, kg.
    pub body_mass_kg: Option<f64>,
}

impl Walker {
    pub(super) fn validate(&self) -> Result<(), ModelError> {
        for (field, value, (low, high)) in [
            ("height_m", self.height_m, Subject::HEIGHT_RANGE_M),
            ("body_mass_kg", self.body_mass_kg, Subject::BODY_MASS_RANGE_KG),
        ] {
            if let Some(value) = value {
                ModelError::check_range(field, value, low, high)?;
            }
        }
        Ok(())
    }
}

/// Times of initial contact: a signal rises above the threshold for the duration of a contact, after no contact for the
/// duration of a swing. Interpolated linearly.
pub(crate) fn contacts(time_s: &[f64], signal: &[f64], threshold: f64) -> Vec<f64> {
    let mut unloaded_since = time_s.first().copied();
    let mut strikes = Vec::new();
    for contact in loaded(time_s, signal, threshold) {
        let k = contact.start;
        if let Some(since) = unloaded_since
            && k > 0
            && time_s[k] - since >= SHORTEST_SWING_S - ROUNDING_S
        {
            let (before, earlier) = (signal[k - 1], time_s[k - 1]);
            strikes.push(earlier + (time_s[k] - earlier) * (threshold - before) / (signal[k] - before));
        }
        unloaded_since = time_s.get(contact.end).copied();
    }
    strikes
}

/// The ranges of samples of the contacts: above the threshold for at least the shortest contact.
fn loaded(time_s: &[f64], signal: &[f64], threshold: f64) -> Vec<Range<usize>> {
    let mut contacts = Vec::new();
    let mut start = 0;
    for samples in signal.chunk_by(|a, b| (*a < threshold) == (*b < threshold)) {
        let end = start + samples.len();
        if samples[0] >= threshold && time_s[end - 1] - time_s[start] >= SHORTEST_CONTACT_S - ROUNDING_S {
            contacts.push(start..end);
        }
        start = end;
    }
    contacts
}

/// Checks given heel strikes: at least two, increasing, and within the recording.
pub(crate) fn given(what: &str, times: &[f64], first: f64, last: f64) -> Result<(), ModelError> {
    for &time in times {
        ModelError::check_range("heel strike (s)", time, first, last)?;
    }
    if times.windows(2).any(|pair| pair[1] <= pair[0]) {
        let reason = "the heel strikes must increase".to_owned();
        return Err(ModelError::Malformed { what: what.to_owned(), reason });
    }
    Ok(())
}

/// The reason why a mean stride does not begin with a right heel strike, if any. At right heel strike the right thigh
/// is ahead of the left one, and the left leg swings in the first half of the stride.
fn not_from_right_heel_strike(mean: &[[f64; 5]]) -> Option<String> {
    let [_, hip_l, _, _, hip_r] = mean[0];
    let cause = "check sides, the signs of the hip angles, and that the heel strikes are those of the right foot";
    if hip_l - hip_r > BEHIND_RAD {
        let behind = (hip_l - hip_r).to_degrees();
        return Some(format!("at right heel strike the right thigh is {behind:.0}° behind the left one; {cause}"));
    }
    let highest = |rows: &[[f64; 5]]| rows.iter().map(|row| row[LEFT_KNEE]).fold(f64::NEG_INFINITY, f64::max);
    let (first, second) = mean.split_at(REFERENCE_ROWS / 2 + 1);
    (highest(second) > highest(first) + STANCE_FLEXION_RAD).then(|| {
        let (first, second) = (highest(first).to_degrees(), highest(second).to_degrees());
        format!(
            "the left leg swings in the first half of the stride from right heel strike, but the left knee bends to {first:.0}° \
             there and to {second:.0}° in the second half; {cause}"
        )
    })
}

/// Formats times in s; only the first and last one if there are many.
fn in_words(times: &[f64]) -> String {
    match times {
        [first, .., last] if times.len() > MANY_STRIKES => format!("{first:.4} to {last:.4}"),
        few => few.iter().map(|time| format!("{time:.4}")).collect::<Vec<_>>().join(", "),
    }
}

impl Recording {
    /// Times of the right heel strikes, s.
    ///
    /// # Errors
    /// [`ModelError`] if there are fewer than two, or if the recording lacks the signal for the method.
    pub fn heel_strikes(&self, how: &HeelStrikes) -> Result<Vec<f64>, ModelError> {
        let malformed = |reason: String| ModelError::Malformed { what: self.what.clone(), reason };
        let found = match how {
            HeelStrikes::Given(times) => {
                given(&self.what, times, self.time_s[0], self.time_s[self.time_s.len() - 1])?;
                times.clone()
            }
            HeelStrikes::Force => {
                let none = || malformed("the recording has no force under the right foot".to_owned());
                let force = self.right_force.as_ref().ok_or_else(none)?;
                let mut strikes = contacts(&force.time_s, &force.force_n, CONTACT_FORCE_N);
                let (first, last) = (self.time_s[0], self.time_s[self.time_s.len() - 1]);
                strikes.retain(|time| (first..=last).contains(time));
                strikes
            }
            HeelStrikes::Kinematics => {
                let knee = self.knee_r_rad.as_ref();
                self.by_kinematics(knee.ok_or_else(|| malformed(NO_KNEE.to_owned()))?)
            }
            HeelStrikes::Ends => vec![self.time_s[0], self.time_s[self.time_s.len() - 1]],
        };
        if found.len() < 2 {
            let force = self.right_force.as_ref().filter(|_| *how == HeelStrikes::Force);
            let recorded = force.map_or_else(String::new, |force| {
                let span = |times: &[f64]| format!("{:.3} to {:.3} s", times[0], times[times.len() - 1]);
                format!(" (angles from {}, forces from {})", span(&self.time_s), span(&force.time_s))
            });
            let hint = match how {
                HeelStrikes::Kinematics => "; for a recording of exactly one stride, use its ends",
                _ => "",
            };
            let reason = format!("{} right heel strikes found{recorded}; a stride needs two{hint}", found.len());
            return Err(malformed(reason));
        }
        Ok(found)
    }

    fn by_kinematics(&self, knee: &[f64]) -> Vec<f64> {
        let ahead: Vec<f64> = self
            .angles_rad
            .iter()
            .zip(knee)
            .map(|(angles, knee)| {
                let thigh = angles[4] - angles[0];
                LEG[0] * thigh.sin() + LEG[1] * (thigh - knee).sin()
            })
            .collect();
        let (first, last) = (self.time_s[0], self.time_s[self.time_s.len() - 1]);
        (1..ahead.len().saturating_sub(1))
            .filter(|&k| {
                let time = self.time_s[k];
                let inside = time - first >= NEIGHBOURHOOD_S && last - time >= NEIGHBOURHOOD_S;
                let near = |other: &usize| (self.time_s[*other] - time).abs() <= NEIGHBOURHOOD_S;
                // The first of equal maxima.
                inside
                    && (0..k).rev().take_while(near).all(|o| ahead[o] < ahead[k])
                    && (k + 1..ahead.len()).take_while(near).all(|o| ahead[o] <= ahead[k])
            })
            .map(|k| self.time_s[k])
            .collect()
    }

    /// The angles at a time, interpolated linearly.
    fn at(&self, time: f64) -> [f64; 5] {
        let after = self.time_s.partition_point(|&t| t < time).clamp(1, self.time_s.len() - 1);
        let (t0, t1) = (self.time_s[after - 1], self.time_s[after]);
        let share = ((time - t0) / (t1 - t0)).clamp(0.0, 1.0);
        let (a, b) = (&self.angles_rad[after - 1], &self.angles_rad[after]);
        std::array::from_fn(|i| a[i] + share * (b[i] - a[i]))
    }

    /// Whether there is no gap between two times.
    fn is_whole(&self, start: f64, end: f64) -> bool {
        self.time_s
            .windows(2)
            .all(|pair| pair[1] <= start || pair[0] >= end || pair[1] - pair[0] <= LONGEST_GAP_S + ROUNDING_S)
    }

    /// The mean stride with its standard deviation, as a reference gait.
    ///
    /// # Errors
    /// [`ModelError`] if no stride is valid, or if the mean stride is implausible.
    pub fn reference(&self, name: &str, how: &HeelStrikes, walker: Walker) -> Result<ReferenceGait, ModelError> {
        walker.validate()?;
        let strikes = self.heel_strikes(how)?;
        let strides: Vec<(f64, f64)> = strikes
            .windows(2)
            .map(|pair| (pair[0], pair[1]))
            .filter(|(start, end)| (STRIDE_RANGE_S.0..=STRIDE_RANGE_S.1).contains(&(end - start)))
            .filter(|(start, end)| self.is_whole(*start, *end))
            .collect();
        let kept = format!("{} to {} s, without a gap of {LONGEST_GAP_S} s", STRIDE_RANGE_S.0, STRIDE_RANGE_S.1);
        if strides.is_empty() {
            let reason = format!("none of the {} strides lasts {kept}", strikes.len() - 1);
            return Err(ModelError::Malformed { what: self.what.clone(), reason });
        }
        let count = strides.len() as f64;
        let mut mean = vec![[0.0; 5]; REFERENCE_ROWS];
        let mut deviation = vec![[0.0; 5]; REFERENCE_ROWS];
        for row in 0..REFERENCE_ROWS {
            let fraction = row as f64 / (REFERENCE_ROWS - 1) as f64;
            let samples: Vec<[f64; 5]> = strides.iter().map(|(a, b)| self.at(a + fraction * (b - a))).collect();
            for i in 0..5 {
                mean[row][i] = samples.iter().map(|s| s[i]).sum::<f64>() / count;
                let squares: f64 = samples.iter().map(|s| (s[i] - mean[row][i]).powi(2)).sum();
                deviation[row][i] = if strides.len() > 1 { (squares / (count - 1.0)).sqrt() } else { 0.0 };
            }
        }
        if let Some(reason) = no_walker(&mean).or_else(|| not_from_right_heel_strike(&mean)) {
            return Err(ModelError::Malformed { what: self.what.clone(), reason });
        }
        let found = match how {
            HeelStrikes::Given(_) => "given",
            HeelStrikes::Ends => "at the ends of the recording",
            HeelStrikes::Force => "by the vertical force under the right foot (above 20 N for 50 ms)",
            HeelStrikes::Kinematics => "by the right heel farthest ahead of the pelvis (Zeni et al. 2008)",
        };
        let mut steps = self.steps.clone();
        steps.push(format!("{} right heel strikes {found}: {} s", strikes.len(), in_words(&strikes)));
        steps.push(format!(
            "mean of {} strides of {kept} ({} dropped), {REFERENCE_ROWS} points each, interpolated linearly",
            strides.len(),
            strikes.len() - 1 - strides.len()
        ));
        steps.extend(unlike_builtin(&mean)?);
        let reference = ReferenceGait {
            name: name.to_owned(),
            provenance: steps.join("\n"),
            angles_rad: mean,
            standard_deviation_rad: (strides.len() > 1).then_some(deviation),
            height_m: walker.height_m,
            body_mass_kg: walker.body_mass_kg,
        };
        reference.validate()?;
        Ok(reference)
    }
}
