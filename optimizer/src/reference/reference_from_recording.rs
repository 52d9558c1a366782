//! A reference gait from a recording: its heel strikes, the strides between them, their mean, and how it was found.

use super::heel_strikes::HeelStrikes;
use super::motion_recording::MotionRecording;
use super::plausibility::{unlike_builtin, why_implausible};
use super::recorded_strides::{MAX_GAP_S, STRIDE_RANGE_S};
use super::reference_gait::{MeasuredPerson, REFERENCE_ROWS, ReferenceGait};
use crate::model_error::ModelError;

/// Index of the left knee among the angles of a reference gait.
const LEFT_KNEE: usize = 2;
/// Smallest angle by which one thigh is clearly behind the other, rad.
const BEHIND_RAD: f64 = 0.05;
/// Largest plausible excess of knee flexion in stance over that in swing, rad. Some people walk with a nearly straight
/// swing leg.
const STANCE_FLEXION_RAD: f64 = 0.26;
/// Largest number of heel strikes that the provenance lists one by one.
const MANY_STRIKES: usize = 200;

/// The reason why a mean stride does not begin with a right heel strike, if any. At right heel strike the right thigh
/// is ahead of the left one, and the left leg swings in the first half of the stride.
fn not_from_right_heel_strike(mean: &[[f64; 5]]) -> Option<String> {
    let [_, hip_l, _, _, hip_r] = mean[0];
    let cause = "check the sides, the signs of the hip angles, and that the heel strikes are those of the right foot";
    if hip_l - hip_r > BEHIND_RAD {
        let behind = (hip_l - hip_r).to_degrees();
        return Some(format!("at right heel strike the right thigh is {behind:.0}° behind the left one; {cause}"));
    }
    let highest = |rows: &[[f64; 5]]| rows.iter().map(|row| row[LEFT_KNEE]).fold(f64::NEG_INFINITY, f64::max);
    let (first, second) = mean.split_at(REFERENCE_ROWS / 2 + 1);
    (highest(second) > highest(first) + STANCE_FLEXION_RAD).then(|| {
        let (first, second) = (highest(first).to_degrees(), highest(second).to_degrees());
        format!(
            "the left leg should swing in the first half of the stride from right heel strike, but the left knee bends less in \
             that half ({first:.0}°) than in the second half ({second:.0}°); {cause}"
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

impl MotionRecording {
    /// The mean stride with its standard deviation, as a reference gait.
    ///
    /// # Errors
    /// [`ModelError`] if no stride is valid, or if the mean stride is implausible.
    pub fn reference(
        &self,
        name: &str,
        how: &HeelStrikes,
        walker: MeasuredPerson,
    ) -> Result<ReferenceGait, ModelError> {
        walker.validate()?;
        let strikes = self.heel_strikes(how)?;
        let strides = self.strides(&strikes).into_iter().filter(|stride| stride.is_used);
        let strides: Vec<(f64, f64)> = strides.map(|stride| (stride.start_s, stride.end_s)).collect();
        let kept = format!("{} to {} s, without gaps longer than {MAX_GAP_S} s", STRIDE_RANGE_S.0, STRIDE_RANGE_S.1);
        if strides.is_empty() {
            let (shortest, longest) = STRIDE_RANGE_S;
            let reason = format!("no stride of {shortest} to {longest} s is free of gaps longer than {MAX_GAP_S} s");
            return Err(ModelError::Malformed { what: self.what.clone(), reason });
        }
        let [mean, deviation] = self.mean_stride(&strides);
        if let Some(reason) = why_implausible(&mean).or_else(|| not_from_right_heel_strike(&mean)) {
            return Err(ModelError::Malformed { what: self.what.clone(), reason });
        }
        let found = match how {
            HeelStrikes::Given(_) => "given",
            HeelStrikes::Ends => "at the ends of the recording",
            HeelStrikes::Force => "detected from the vertical force under the right foot (above 20 N for 50 ms)",
            HeelStrikes::Kinematics => {
                "detected where the right heel is farthest ahead of the pelvis (Zeni et al. 2008)"
            }
        };
        let mut steps = self.steps.clone();
        steps.push(format!("{} right heel strikes {found}: {} s", strikes.len(), in_words(&strikes)));
        let averaged = if strides.len() == 1 { "1 stride".to_owned() } else { format!("{} strides", strides.len()) };
        steps.push(format!(
            "mean of {averaged} of {kept} ({} dropped), {REFERENCE_ROWS} points each, interpolated linearly",
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
