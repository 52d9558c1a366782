//! Phase portraits of measured walking: joint angles over some seconds, each against its velocity.
//!
//! Velocities are central differences of the angles after a zero-phase Butterworth low-pass of order 4 (of one pass);
//! the portrait shows the filtered angle. The first and last samples have no neighbour on one side and are left out.

use crate::filter::{extension, filter, low_pass};
use crate::opensim::{AngleUnit, StorageFile};
use crate::subject::ModelError;
use crate::table::{Clock, Separator, Table, malformed};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Order of one pass of the low-pass.
const ORDER: usize = 4;
/// Largest angle of a recording, rad: a wrong unit exceeds it.
const LARGEST_ANGLE_RAD: f64 = PI;

/// The joints of the walker, as columns of our own table. Forward lean, flexion and dorsiflexion are positive, hips are
/// measured from the trunk.
pub const JOINTS: [&str; 7] = ["torso", "hip_L", "knee_L", "ankle_L", "hip_R", "knee_R", "ankle_R"];
/// The columns of OpenSim's gait models that make a joint, each with its sign; hips and trunk are put together from two.
const OPENSIM: [(&str, &[(&str, f64)]); 7] = [
    ("torso", &[("pelvis_tilt", -1.0), ("lumbar_extension", -1.0)]),
    ("hip_L", &[("hip_flexion_l", 1.0), ("lumbar_extension", -1.0)]),
    ("knee_L", &[("knee_angle_l", -1.0)]),
    ("ankle_L", &[("ankle_angle_l", 1.0)]),
    ("hip_R", &[("hip_flexion_r", 1.0), ("lumbar_extension", -1.0)]),
    ("knee_R", &[("knee_angle_r", -1.0)]),
    ("ankle_R", &[("ankle_angle_r", 1.0)]),
];

/// Joint angles over time, evenly sampled.
#[derive(Debug, Clone, PartialEq)]
pub struct JointRecording {
    /// Samples per second.
    pub rate_hz: f64,
    /// Name and angles of each joint that was recorded, rad.
    pub joints: Vec<(&'static str, Vec<f64>)>,
}

/// A joint's angle and velocity, sample after sample.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PhasePortrait {
    /// Name of the joint.
    pub joint: String,
    /// Angle, rad.
    pub angle_rad: Vec<f64>,
    /// Velocity, rad/s.
    pub velocity_rad_s: Vec<f64>,
}

impl JointRecording {
    /// Our own table: `time_s` and any of `torso_rad`, `hip_L_rad`, ..., `ankle_R_rad`.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_csv(what: &str, text: &str) -> Result<Self, ModelError> {
        let lines: Vec<&str> = text.lines().collect();
        let comments = lines.iter().take_while(|line| line.starts_with('#')).count();
        let first_line = comments + 1;
        let table = Table::read(what, &lines[comments..], first_line, Separator::Comma, Clock::Column("time_s"))?;
        let joints = JOINTS.into_iter().filter_map(|joint| Some((joint, table.find(&format!("{joint}_rad"))?)));
        Self::whole(what, &table, first_line, joints.collect())
    }

    /// An OpenSim motion or storage file of a gait model, with the joints whose columns it has.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_opensim(what: &str, text: &str, unit: Option<AngleUnit>) -> Result<Self, ModelError> {
        let file = StorageFile::read(what, text)?;
        let scale = file.angle_unit(what, unit)?.in_radians();
        let joint = |(joint, columns): (&'static str, &[(&str, f64)])| {
            let mut angles = vec![0.0; file.table.len()];
            for (column, sign) in columns {
                let values = match file.table.find(column) {
                    Some(values) => values,
                    // A model without a lumbar joint has pelvis and trunk in one.
                    None if *column == "lumbar_extension" => continue,
                    None => return None,
                };
                for (angle, value) in angles.iter_mut().zip(values) {
                    *angle += sign * scale * value;
                }
            }
            Some((joint, angles))
        };
        Self::whole(what, &file.table, file.first_line(), OPENSIM.into_iter().filter_map(joint).collect())
    }

    fn whole(
        what: &str,
        table: &Table,
        first_line: usize,
        joints: Vec<(&'static str, Vec<f64>)>,
    ) -> Result<Self, ModelError> {
        if joints.is_empty() {
            let reason = format!("no column is a joint's; there are {}", table.names().join(", "));
            return Err(malformed(what, first_line, None, reason));
        }
        for (joint, angles) in &joints {
            if let Some(row) = angles.iter().position(|angle| angle.abs() > LARGEST_ANGLE_RAD) {
                let reason = format!("{joint} is {:.1} rad: is the unit right?", angles[row]);
                return Err(malformed(what, first_line + 1 + row, None, reason));
            }
        }
        Ok(Self { rate_hz: table.even_rate_hz(first_line)?, joints })
    }

    /// The phase portrait of every joint; `cutoff_hz` is the edge of the low-pass.
    ///
    /// # Errors
    /// [`ModelError`] for an edge out of range, or when the recording is too short to be filtered.
    pub fn portraits(&self, cutoff_hz: f64) -> Result<Vec<PhasePortrait>, ModelError> {
        ModelError::check_range("cutoff_hz", cutoff_hz, 0.5, 0.45 * self.rate_hz)?;
        let smooth = low_pass(ORDER, cutoff_hz / (0.5 * self.rate_hz));
        let fewest = extension(&smooth) + 1;
        let portrait = |(joint, angles): &(&'static str, Vec<f64>)| {
            if angles.len() < fewest {
                let reason = format!("{} samples, the filter needs {fewest}", angles.len());
                return Err(ModelError::Malformed { what: format!("joint {joint}"), reason });
            }
            let filtered = filter(&smooth, angles);
            Ok(PhasePortrait {
                joint: (*joint).to_owned(),
                velocity_rad_s: filtered.windows(3).map(|near| 0.5 * (near[2] - near[0]) * self.rate_hz).collect(),
                angle_rad: filtered[1..filtered.len() - 1].to_vec(),
            })
        };
        self.joints.iter().map(portrait).collect()
    }
}
