//! From a recording to a reference: heel strikes, strides of 101 points, mean and standard deviation.

use super::recording::Recording;
use super::{REFERENCE_ROWS, ReferenceGait};
use crate::subject::{ModelError, Subject};
use plausible::{no_walker, unlike_builtin};
use std::ops::Range;

mod plausible;

/// Durations of strides that are kept, s.
pub const STRIDE_RANGE_S: (f64, f64) = (0.8, 1.6);
/// What to do where heel strikes cannot be found in the angles.
const NO_KNEE: &str = "the right knee (column knee_R_rad) was not recorded, and without it heel strikes cannot be found in the angles: \
                       tell the times of the right heel strikes, or take a force under the right foot";
/// A stride with more than so long between two rows is not wholly recorded, s.
const LONGEST_GAP_S: f64 = 0.1;
/// Vertical force that tells contact, N.
const CONTACT_FORCE_N: f64 = 20.0;
/// A heel strike by force comes after at least so long without contact, s.
const SHORTEST_SWING_S: f64 = 0.1;
/// A contact lasts at least so long, s: what noise or vibration makes of an unloaded plate is shorter.
const SHORTEST_CONTACT_S: f64 = 0.05;
/// What differences of times may be off by rounding, s.
const ROUNDING_S: f64 = 1e-9;
/// A heel strike by kinematics is the farthest forward heel within so long before and after, s.
const NEIGHBOURHOOD_S: f64 = 0.3;
/// Place of the left knee among the reference's angles.
const LEFT_KNEE: usize = 2;
/// A thigh that is so far behind is behind, rad.
const BEHIND_RAD: f64 = 0.05;
/// A knee may bend so much more while it carries than while it swings, rad: legs that swing nearly straight are walked with, too.
const STANCE_FLEXION_RAD: f64 = 0.26;
/// So many heel strikes are written down one by one.
const MANY_STRIKES: usize = 200;
/// Thigh and shank, in body heights (Winter 2009).
const LEG: [f64; 2] = [0.245, 0.246];

/// How right heel strikes are found.
#[derive(Debug, Clone, PartialEq)]
pub enum HeelStrikes {
    /// At these times, s.
    Given(Vec<f64>),
    /// Where the vertical force under the right foot rises above 20 N, to stay there for 50 ms.
    Force,
    /// Where the right heel is farthest ahead of the pelvis (Zeni et al. 2008, Gait & Posture 27:710).
    Kinematics,
    /// The first and the last row: the recording is one stride, as this program writes gaits.
    Ends,
}

/// Whose gait was recorded, where that is known.
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

/// When a foot comes to the ground: where a signal that tells contact rises above a threshold for a contact, having had
/// none for a swing. Linear between samples.
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

/// The samples of each contact: all above the threshold, for as long as a contact lasts.
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

/// Heel strikes that were told: in order, within the recording, at least two.
pub(crate) fn given(what: &str, times: &[f64], first: f64, last: f64) -> Result<(), ModelError> {
    for &time in times {
        ModelError::check_range("heel strike (s)", time, first, last)?;
    }
    if times.windows(2).any(|pair| pair[1] <= pair[0]) {
        let reason = "the heel strikes are not in order".to_owned();
        return Err(ModelError::Malformed { what: what.to_owned(), reason });
    }
    Ok(())
}

/// Why the mean of the strides does not begin where the right heel strikes: then the right thigh is ahead of the left one,
/// and the left leg swings in the first half.
fn not_from_right_heel_strike(mean: &[[f64; 5]]) -> Option<String> {
    let [_, hip_l, _, _, hip_r] = mean[0];
    let cause =
        "are left and right, or the signs of the hips, the other way round, or the heel strikes not the right foot's?";
    if hip_l - hip_r > BEHIND_RAD {
        let behind = (hip_l - hip_r).to_degrees();
        return Some(format!("at right heel strike the right thigh is {behind:.0}° behind the left one: {cause}"));
    }
    let highest = |rows: &[[f64; 5]]| rows.iter().map(|row| row[LEFT_KNEE]).fold(f64::NEG_INFINITY, f64::max);
    let (first, second) = mean.split_at(REFERENCE_ROWS / 2 + 1);
    (highest(second) > highest(first) + STANCE_FLEXION_RAD).then(|| {
        let (first, second) = (highest(first).to_degrees(), highest(second).to_degrees());
        format!(
            "the left knee bends to {second:.0}° in the second half of the stride from right heel strike and to {first:.0}° in \
             the first, in which the left leg swings: {cause}"
        )
    })
}

/// Times, s; of many, the first and the last.
fn in_words(times: &[f64]) -> String {
    match times {
        [first, .., last] if times.len() > MANY_STRIKES => format!("{first:.4} to {last:.4}"),
        few => few.iter().map(|time| format!("{time:.4}")).collect::<Vec<_>>().join(", "),
    }
}

impl Recording {
    /// Times of right heel strikes, s.
    ///
    /// # Errors
    /// [`ModelError`] when there are fewer than two, or when what is asked for was not recorded.
    pub fn heel_strikes(&self, how: &HeelStrikes) -> Result<Vec<f64>, ModelError> {
        let malformed = |reason: String| ModelError::Malformed { what: self.what.clone(), reason };
        let found = match how {
            HeelStrikes::Given(times) => {
                given(&self.what, times, self.time_s[0], self.time_s[self.time_s.len() - 1])?;
                times.clone()
            }
            HeelStrikes::Force => {
                let none = || malformed("no force under the right foot was recorded".to_owned());
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
                HeelStrikes::Kinematics => "; a recording of one stride begins and ends with one: choose its ends",
                _ => "",
            };
            let reason = format!("{} right heel strikes{recorded}, two make a stride{hint}", found.len());
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
                // Of equal heights the first one.
                inside
                    && (0..k).rev().take_while(near).all(|o| ahead[o] < ahead[k])
                    && (k + 1..ahead.len()).take_while(near).all(|o| ahead[o] <= ahead[k])
            })
            .map(|k| self.time_s[k])
            .collect()
    }

    /// The angles at a time, linear between rows.
    fn at(&self, time: f64) -> [f64; 5] {
        let after = self.time_s.partition_point(|&t| t < time).clamp(1, self.time_s.len() - 1);
        let (t0, t1) = (self.time_s[after - 1], self.time_s[after]);
        let share = ((time - t0) / (t1 - t0)).clamp(0.0, 1.0);
        let (a, b) = (&self.angles_rad[after - 1], &self.angles_rad[after]);
        std::array::from_fn(|i| a[i] + share * (b[i] - a[i]))
    }

    /// Whether no row is missing between two times.
    fn is_whole(&self, start: f64, end: f64) -> bool {
        self.time_s
            .windows(2)
            .all(|pair| pair[1] <= start || pair[0] >= end || pair[1] - pair[0] <= LONGEST_GAP_S + ROUNDING_S)
    }

    /// The mean stride with its standard deviation, as a reference.
    ///
    /// # Errors
    /// [`ModelError`] when no stride is left.
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
            let reason = format!("none of {} strides lasts {kept}", strikes.len() - 1);
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
            HeelStrikes::Force => "by the force under the right foot (above 20 N for 50 ms)",
            HeelStrikes::Kinematics => "by the farthest forward right heel (Zeni et al. 2008)",
        };
        let mut steps = self.steps.clone();
        steps.push(format!("{} right heel strikes {found}: {} s", strikes.len(), in_words(&strikes)));
        steps.push(format!(
            "mean of {} strides of {kept} ({} dropped), {REFERENCE_ROWS} points each, linear between rows",
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
