//! A preview of a recording of joint angles before it is stored: its angles over time, and the strides between right heel
//! strikes, which are found from the joint angles.

use super::file_format::MeasurementFormat;
use super::joint_cycles::{WalkingLeg, strides};
use super::upload::{JointAngleReading, NewJointAngles};
use crate::error::Error;
use crate::studies::angle_curves::ColumnChoice;
use crate::studies::signal_extremes::extremes;
use gait_optimizer::limit_cycle::JointRecording;
use gait_optimizer::reference::RecordedStride;

/// A preview of a recording of joint angles.
#[derive(Debug)]
pub struct JointAnglePreview {
    /// Each recorded joint, one of [`gait_optimizer::limit_cycle::JOINTS`], with the smallest and the largest angle, °, of
    /// intervals over the time since the start, s.
    pub traces: Vec<(&'static str, Vec<(f64, f64)>)>,
    /// Right heel strikes, s; empty without the angles of torso, right hip and right knee.
    pub strikes_s: Vec<f64>,
    /// The strides between them.
    pub strides: Vec<RecordedStride>,
    /// Why the file would be refused as it is; empty if it would be accepted.
    pub refused: Vec<Error>,
}

impl NewJointAngles {
    /// Reads the file and previews it. What is missing for an upload is said in [`JointAnglePreview::refused`].
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column if the file cannot be read.
    pub fn preview(&self) -> Result<JointAnglePreview, Error> {
        let recording = self.reading.joints(&self.recording)?;
        let trace = |(joint, angles): &(&'static str, Vec<f64>)| {
            let point = |(sample, angle): (usize, f64)| (sample as f64 / recording.rate_hz, angle.to_degrees());
            (*joint, extremes(angles).into_iter().map(point).collect())
        };
        let (strikes_s, strides) = strides(&recording, WalkingLeg::Right).unwrap_or_default();
        let refused = self.reading.faults(&self.recording);
        Ok(JointAnglePreview { traces: recording.joints.iter().map(trace).collect(), strikes_s, strides, refused })
    }
}

impl NewJointAngles {
    /// The columns of the file and their curves, to choose them on a page.
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column if the file cannot be read.
    pub fn column_choice(&self) -> Result<ColumnChoice, Error> {
        let JointAngleReading { columns, unit, .. } = &self.reading;
        ColumnChoice::of(&self.reading.table(&self.recording)?, columns, unit.map(Into::into), &[])
    }

    /// Whether the file can be read, but its columns do not have the names of its format.
    pub fn needs_columns(&self) -> bool {
        self.reading.table(&self.recording).is_ok_and(|file| match self.reading.format {
            MeasurementFormat::Csv => !JointRecording::has_names_of_csv(&file),
            MeasurementFormat::Opensim => !JointRecording::has_names_of_opensim(&file),
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::studies::lab::JointAngleReading;
    use std::fmt::Write;

    /// Twelve seconds of a leg that swings once in 1.2 s.
    fn recording(columns: &str) -> NewJointAngles {
        let mut text = format!("time_s,{columns}\n");
        for sample in 0..1200 {
            let time = f64::from(sample) / 100.0;
            let phase = std::f64::consts::TAU * time / 1.2;
            write!(text, "{time}").unwrap();
            for column in columns.split(',') {
                let angle = if column == "torso_rad" { 0.02 * phase.sin() } else { 0.4 * phase.cos() };
                write!(text, ",{angle}").unwrap();
            }
            text.push('\n');
        }
        NewJointAngles { walk: 1, recording: text, reading: JointAngleReading::default() }
    }

    #[test]
    fn preview_has_traces_and_heel_strikes_found_from_the_angles() {
        let shown = recording("torso_rad,hip_R_rad,knee_R_rad").preview().unwrap();
        assert!(shown.refused.is_empty(), "{:?}", shown.refused);
        assert_eq!(shown.traces.iter().map(|(joint, _)| *joint).collect::<Vec<_>>(), ["torso", "hip_R", "knee_R"]);
        assert!(shown.strikes_s.len() >= 8, "{:?}", shown.strikes_s);
        assert!(shown.strides.iter().all(|stride| (stride.end_s - stride.start_s - 1.2).abs() < 0.03));
    }

    #[test]
    fn preview_without_the_right_leg_has_traces_only() {
        let shown = recording("hip_L_rad").preview().unwrap();
        assert!(shown.strikes_s.is_empty() && shown.strides.is_empty() && shown.traces.len() == 1);
    }
}
