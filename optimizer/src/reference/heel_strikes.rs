//! Heel strikes of a recording: given, by force, or by kinematics.

use super::motion_recording::MotionRecording;
use crate::model_error::ModelError;
use std::ops::Range;

/// The error if heel strikes cannot be found from joint angles.
const NO_KNEE: &str = "the recording has no right knee angle (column knee_R_rad), which is needed to find heel strikes from joint \
                       angles; give the times of the right heel strikes, or use a force under the right foot";
/// The error if heel strikes cannot be found from forces.
const NO_FORCE: &str =
    "the recording has no force under the right foot; add the force, or find the heel strikes in another way";
/// Vertical force above which the foot is in contact, N.
const CONTACT_FORCE_N: f64 = 20.0;
/// Shortest time without contact before a heel strike, s.
pub(crate) const MIN_SWING_S: f64 = 0.1;
/// Shortest contact, s. Noise and vibration of an unloaded plate are shorter.
pub(crate) const MIN_CONTACT_S: f64 = 0.05;
/// Rounding error of a difference of times, s.
pub(super) const ROUNDING_S: f64 = 1e-9;
/// Half width of the window in which a heel strike by kinematics is the maximum, s.
const NEIGHBOURHOOD_S: f64 = 0.3;
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

/// Times of initial contact: a signal rises above the threshold for the duration of a contact, after no contact for the
/// duration of a swing. Interpolated linearly.
pub(crate) fn contacts(time_s: &[f64], signal: &[f64], threshold: f64) -> Vec<f64> {
    let mut unloaded_since = time_s.first().copied();
    let mut strikes = Vec::new();
    for contact in loaded(time_s, signal, threshold) {
        let k = contact.start;
        if let Some(since) = unloaded_since
            && k > 0
            && time_s[k] - since >= MIN_SWING_S - ROUNDING_S
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
        if samples[0] >= threshold && time_s[end - 1] - time_s[start] >= MIN_CONTACT_S - ROUNDING_S {
            contacts.push(start..end);
        }
        start = end;
    }
    contacts
}

/// Checks given heel strikes: at least two, increasing, and within the recording.
pub(crate) fn given(what: &str, times: &[f64], first: f64, last: f64) -> Result<(), ModelError> {
    for &time in times {
        ModelError::check_range("heel_strikes_s", time, first, last)?;
    }
    if times.windows(2).any(|pair| pair[1] <= pair[0]) {
        let reason = "the heel-strike times must increase".to_owned();
        return Err(ModelError::Malformed { what: what.to_owned(), reason });
    }
    Ok(())
}

impl MotionRecording {
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
                let none = || malformed(NO_FORCE.to_owned());
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
                HeelStrikes::Kinematics => {
                    "; if the recording is exactly one stride, such as an exported gait, use its first and last rows as heel \
                     strikes"
                }
                _ => "",
            };
            let reason = format!("right heel strikes found: {}{recorded}; a stride needs two{hint}", found.len());
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
}
