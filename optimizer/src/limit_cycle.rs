//! Limit cycles of measured walking: joint angles against their velocities over some seconds.
//!
//! A zero-phase Butterworth low-pass (order 4 in one pass) filters the angles; velocities are their central
//! differences. Unevenly spaced rows are first interpolated linearly on an even grid. The first and last samples have
//! no central difference and are omitted.

use crate::angle_table::{AngleColumn, AngleTable};
use crate::model_error::ModelError;
use crate::opensim_reading::{AngleUnit, StorageFile};
use crate::reference::{MAX_ANGLE_RAD, MotionRecording};
use crate::signal_filter::{extension, filter, low_pass};
use crate::statistics::extremes;
use crate::table::{Separator, Table, TimeColumn, lines_of};
use serde::{Deserialize, Serialize};

/// Order of one pass of the low-pass.
const ORDER: usize = 4;
/// Longest gap between two rows that is interpolated, s.
const MAX_GAP_S: f64 = 0.05;
/// Shortest recording that shows a limit cycle, s: more than one stride. The paper shows ten seconds.
const MIN_RECORDING_S: f64 = 2.0;
/// Rounding error of a difference of times, s.
const ROUNDING_S: f64 = 1e-9;
/// Largest range of motion of a joint at rest, rad.
const MAX_RANGE_AT_REST_RAD: f64 = 0.05;

pub use crate::reference::JOINTS;

/// Each joint as a signed sum of columns of OpenSim's gait models. Hips and torso have two columns.
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
    /// Name and angles (rad) of each recorded joint.
    pub joints: Vec<(&'static str, Vec<f64>)>,
}

/// Angle and velocity of a joint, sample by sample.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LimitCycle {
    /// Name of the joint.
    pub joint: String,
    /// Angle, rad.
    pub angle_rad: Vec<f64>,
    /// Velocity, rad/s.
    pub velocity_rad_s: Vec<f64>,
}

impl JointRecording {
    /// Parses Gaitwright's table: `time_s` and any of `torso_rad`, `hip_L_rad`, ..., `ankle_R_rad`.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_csv(what: &str, text: &str) -> Result<Self, ModelError> {
        let lines = lines_of(text);
        let comments = lines.iter().take_while(|line| line.starts_with('#')).count();
        let table =
            Table::read(what, &lines[comments..], comments + 1, Separator::Comma, TimeColumn::Column("time_s"))?;
        let joints = JOINTS.into_iter().filter_map(|joint| Some((joint, table.find(&format!("{joint}_rad"))?)));
        Self::whole(&table, joints.collect())
    }

    /// Parses an OpenSim motion or storage file of a gait model, with any of its joints.
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
                    // Without a lumbar joint, the pelvis stands for the torso.
                    None if *column == "lumbar_extension" => continue,
                    None => return None,
                };
                for (angle, value) in angles.iter_mut().zip(values) {
                    *angle += sign * scale * value;
                }
            }
            Some((joint, angles))
        };
        Self::whole(&file.table, OPENSIM.into_iter().filter_map(joint).collect())
    }

    /// Whether a CSV file has the names that [`Self::from_csv`] reads.
    pub fn has_names_of_csv(file: &AngleTable) -> bool {
        JOINTS.iter().any(|joint| file.has("time_s", &[&format!("{joint}_rad")]))
    }

    /// Whether an OpenSim file has the names that [`Self::from_opensim`] reads.
    pub fn has_names_of_opensim(file: &AngleTable) -> bool {
        OPENSIM.iter().any(|(_, columns)| columns.first().is_some_and(|(column, _)| file.has("time", &[column])))
    }

    /// The joints of a file whose columns were chosen.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_columns(file: &AngleTable, unit: AngleUnit, columns: &[AngleColumn<'_>]) -> Result<Self, ModelError> {
        let mut joints = Vec::new();
        for joint in JOINTS {
            if let Some(column) = columns.iter().find(|column| column.joint == joint) {
                joints.push((joint, file.angle(column, unit)?));
            }
        }
        Self::whole(file.table(), joints)
    }

    fn whole(table: &Table, joints: Vec<(&'static str, Vec<f64>)>) -> Result<Self, ModelError> {
        if joints.is_empty() {
            let reason =
                format!("no column has the name of a joint angle; the columns are {}", table.names().join(", "));
            return Err(table.malformed_names(reason));
        }
        for (joint, angles) in &joints {
            if let Some(row) = angles.iter().position(|angle| angle.abs() > MAX_ANGLE_RAD) {
                let angle = angles[row];
                let reason = format!(
                    "{joint} is {angle:.1} rad; plausible angles are at most {MAX_ANGLE_RAD:.2} rad in either direction; \
                     check the unit"
                );
                return Err(table.malformed_row(row, None, reason));
            }
        }
        let times = table.times();
        if let Some(row) = times.windows(2).position(|pair| pair[1] - pair[0] > MAX_GAP_S + ROUNDING_S) {
            let gap_s = times[row + 1] - times[row];
            let reason = format!("there is a gap of {gap_s:.3} s between rows; gaps may be at most {MAX_GAP_S} s long");
            return Err(table.malformed_row(row + 1, Some(1), reason));
        }
        let rate_hz = (times.len() - 1) as f64 / (times[times.len() - 1] - times[0]);
        let joints = joints.into_iter().map(|(joint, angles)| (joint, evenly(&times, &angles))).collect();
        Ok(Self { rate_hz, joints })
    }

    /// Checks that the recording can show a limit cycle of walking: its duration and the motion of its joints.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] for the file `what`.
    pub fn check_walking(&self, what: &str) -> Result<(), ModelError> {
        let refused = self.too_short().or_else(|| self.still()).or_else(|| {
            self.joints.iter().find_map(|(joint, angles)| {
                let knee = if joint.starts_with("knee") { MotionRecording::no_knee(angles) } else { None };
                knee.or_else(|| self.jump(angles)).map(|reason| format!("{joint} {reason}"))
            })
        });
        refused.map_or(Ok(()), |reason| Err(ModelError::Malformed { what: what.to_owned(), reason }))
    }

    fn too_short(&self) -> Option<String> {
        let samples = self.joints.first().map_or(0, |(_, angles)| angles.len());
        let lasts = samples.saturating_sub(1) as f64 / self.rate_hz;
        (lasts < MIN_RECORDING_S - ROUNDING_S)
            .then(|| format!("the recording lasts {lasts:.3} s; a limit cycle needs at least {MIN_RECORDING_S} s"))
    }

    fn still(&self) -> Option<String> {
        let range = |angles: &[f64]| {
            let (lowest, highest) = extremes(angles);
            highest - lowest
        };
        let most = self.joints.iter().map(|(_, angles)| range(angles)).fold(0.0, f64::max);
        (most <= MAX_RANGE_AT_REST_RAD).then(|| {
            format!("no joint moves by more than {MAX_RANGE_AT_REST_RAD} rad (the largest range is {most:.3} rad); check the unit")
        })
    }

    /// The reason why an evenly sampled angle is implausible: it jumps.
    fn jump(&self, angles: &[f64]) -> Option<String> {
        let times: Vec<f64> = (0..angles.len()).map(|row| row as f64 / self.rate_hz).collect();
        let (row, jump_rad) = MotionRecording::jump(&times, angles)?;
        Some(format!(
            "jumps by {jump_rad:.2} rad in {:.4} s, {:.3} s after the first row",
            1.0 / self.rate_hz,
            times[row]
        ))
    }

    /// The limit cycle of each joint; `cutoff_hz` is the edge of the low-pass.
    ///
    /// # Errors
    /// [`ModelError`] if the edge is out of range or the recording is too short for the filter.
    pub fn limit_cycles(&self, cutoff_hz: f64) -> Result<Vec<LimitCycle>, ModelError> {
        ModelError::check_range("cutoff_hz", cutoff_hz, 0.5, 0.45 * self.rate_hz)?;
        let smooth = low_pass(ORDER, cutoff_hz / (0.5 * self.rate_hz));
        let fewest = extension(&smooth) + 1;
        let limit_cycle = |(joint, angles): &(&'static str, Vec<f64>)| {
            if angles.len() < fewest {
                let reason = format!("the recording has {} samples; the filter needs at least {fewest}", angles.len());
                return Err(ModelError::Malformed { what: format!("joint {joint}"), reason });
            }
            let filtered = filter(&smooth, angles);
            Ok(LimitCycle {
                joint: (*joint).to_owned(),
                velocity_rad_s: filtered.windows(3).map(|near| 0.5 * (near[2] - near[0]) * self.rate_hz).collect(),
                angle_rad: filtered[1..filtered.len() - 1].to_vec(),
            })
        };
        self.joints.iter().map(limit_cycle).collect()
    }
}

/// A signal interpolated linearly at the same number of evenly spaced times.
fn evenly(times: &[f64], signal: &[f64]) -> Vec<f64> {
    let last = times.len() - 1;
    let step = (times[last] - times[0]) / last as f64;
    let mut after = 1;
    (0..times.len())
        .map(|k| {
            let time = times[0] + step * k as f64;
            while after < last && times[after] < time {
                after += 1;
            }
            let (before, behind) = (times[after - 1], times[after]);
            let share = ((time - before) / (behind - before)).clamp(0.0, 1.0);
            signal[after - 1] + share * (signal[after] - signal[after - 1])
        })
        .collect()
}
