//! A preview of a recording of joint angles before it becomes a reference gait: its angles over time, its heel strikes, the
//! strides between them, and their mean.

use super::lab::extremes;
use super::reference_import::{FORCES, NewReferenceGait, RECORDING};
use crate::error::Error;
use gait_optimizer::ReferenceGait as Definition;
use gait_optimizer::reference::RecordedStride;

/// The joints of a recording, in the order of its angles.
const JOINTS: [&str; 5] = ["Torso lean", "Left hip", "Left knee", "Left ankle", "Right hip"];

/// A preview of a recording.
#[derive(Debug)]
pub struct ReferencePreview {
    /// The angles of each recorded joint.
    pub traces: Vec<AngleTrace>,
    /// Right heel strikes, s; empty if they are unknown.
    pub strikes_s: Vec<f64>,
    /// The strides between them.
    pub strides: Vec<RecordedStride>,
    /// The reference gait that an import would make, or why the recording would be refused.
    pub reference: Result<Definition, Error>,
}

/// A joint angle over time.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleTrace {
    /// The joint.
    pub joint: &'static str,
    /// Smallest and largest angle, °, of intervals over time, s.
    pub points: Vec<(f64, f64)>,
}

impl NewReferenceGait {
    /// Reads the recording and previews it. What is missing for an import is said in [`ReferencePreview::reference`].
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column if the recording cannot be read.
    pub fn preview(&self) -> Result<ReferencePreview, Error> {
        let recording = self.motion(RECORDING, FORCES)?;
        let trace = |joint: &'static str, angles: &[f64]| {
            let point = |(row, angle): (usize, f64)| (recording.time_s[row], angle.to_degrees());
            AngleTrace { joint, points: extremes(angles).into_iter().map(point).collect() }
        };
        let angles = |place: usize| recording.angles_rad.iter().map(|row| row[place]).collect::<Vec<f64>>();
        let mut traces: Vec<AngleTrace> =
            JOINTS.iter().enumerate().map(|(place, joint)| trace(joint, &angles(place))).collect();
        traces.extend(recording.knee_r_rad.as_ref().map(|angles| trace("Right knee", angles)));
        let strikes_s = recording.heel_strikes(&self.heel_strikes()).unwrap_or_default();
        let strides = recording.strides(&strikes_s);
        let reference = self.definition_of(&recording);
        Ok(ReferencePreview { traces, strikes_s, strides, reference })
    }
}
