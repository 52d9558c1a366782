//! A preview of a recording of joint angles before it becomes a reference gait: its angles over time, its heel strikes, the
//! strides between them, and their mean.

use super::angle_curves::ColumnChoice;
use super::reference_import::{FORCES, JointAngleFormat, NewReferenceGait, RECORDING};
use super::signal_extremes::extremes;
use crate::error::Error;
use gait_optimizer::ReferenceGait as Definition;
use gait_optimizer::reference::{AngleUnit, MotionRecording, RecordedStride};

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
    /// The columns of the file and their curves, to choose them on a page.
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column if the file cannot be read.
    pub fn column_choice(&self) -> Result<ColumnChoice, Error> {
        let degrees = (self.format == JointAngleFormat::Camargo).then_some(AngleUnit::Degrees);
        let unit = self.unit.map(Into::into).or(degrees);
        ColumnChoice::of(&self.table(RECORDING)?, &self.columns, unit, &self.heel_strikes_s)
    }

    /// Whether the file can be read, but its columns do not have the names of its format.
    pub fn needs_columns(&self) -> bool {
        self.table(RECORDING).is_ok_and(|file| match self.format {
            JointAngleFormat::Opensim => !MotionRecording::has_names_of_opensim(&file),
            JointAngleFormat::Camargo => !MotionRecording::has_names_of_camargo(&file),
            JointAngleFormat::Csv => !MotionRecording::has_names_of_csv(&file),
        })
    }

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
