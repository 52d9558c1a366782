//! A recording of joint angles over several strides, converted to the convention of the walker.

use super::reference_gait::{MAX_ANGLE_RAD, REFERENCE_COLUMNS};
use crate::angle_table::{AngleColumn, AngleTable};
use crate::model_error::ModelError;
use crate::opensim_reading::{AngleUnit, StorageFile};
use crate::statistics::extremes;
use crate::table::{Separator, Table, TimeColumn, lines_of};

/// Index of the left knee among the angles of a reference gait.
const KNEE: usize = 2;
/// The columns of OpenSim's gait models without which a file is no reference gait.
const OPENSIM_COLUMNS: [&str; 5] = ["pelvis_tilt", "hip_flexion_l", "knee_angle_l", "ankle_angle_l", "hip_flexion_r"];
/// Smallest range of motion of a walking knee, rad. Radians taken for degrees are below.
const MIN_KNEE_RANGE_RAD: f64 = 0.1;
/// Largest plausible angular velocity between two rows, rad/s. A knee in swing reaches about 7; marker noise adds to
/// it.
const MAX_SPEED_RAD_S: f64 = 40.0;

/// Joint angles over time in the convention of the walker: torso, hip_L, knee_L, ankle_L and hip_R, rad.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionRecording {
    /// Name of the file.
    pub what: String,
    /// Times of the rows, s.
    pub time_s: Vec<f64>,
    /// One row of five angles for each time.
    pub angles_rad: Vec<[f64; 5]>,
    /// Right knee, if recorded, rad; needed to detect heel strikes by kinematics.
    pub knee_r_rad: Option<Vec<f64>>,
    /// Vertical force under the right foot, if recorded.
    pub right_force: Option<VerticalForce>,
    /// Processing steps, for the provenance of the reference gait.
    pub steps: Vec<String>,
}

/// A vertical force with its own times, because force plates often have a higher sampling rate than markers.
#[derive(Debug, Clone, PartialEq)]
pub struct VerticalForce {
    /// s.
    pub time_s: Vec<f64>,
    /// N.
    pub force_n: Vec<f64>,
}

impl VerticalForce {
    fn of(table: &Table, column: &str) -> Result<Self, ModelError> {
        Ok(Self { time_s: table.times(), force_n: table.column(column)? })
    }
}

impl MotionRecording {
    /// Parses an OpenSim motion or storage file (.mot, .sto) of a gait model. `unit` applies if the header has no
    /// `inDegrees`. `force_column`, if given, is the vertical force under the right foot.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_opensim(
        what: &str,
        text: &str,
        unit: Option<AngleUnit>,
        force_column: Option<&str>,
    ) -> Result<Self, ModelError> {
        let file = StorageFile::read(what, text)?;
        let unit = file.angle_unit(what, unit)?;
        let table = file.table;
        let mut steps =
            vec![format!("{what}: OpenSim motion file, {} rows, angles in {}", table.len(), unit.in_words())];
        Self::from_opensim_columns(what, &table, unit.in_radians(), force_column, &mut steps)
    }

    /// Adds the vertical force under the right foot from a separate OpenSim file such as `subject01_grf.mot`. Both
    /// files must have the same clock.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn with_force_file(self, what: &str, text: &str, column: &str) -> Result<Self, ModelError> {
        self.with_force(what, &StorageFile::read(what, text)?.table, column)
    }

    /// Adds the vertical force under the right foot from the `fp` table of a trial of Camargo et al. 2021, exported in
    /// the same way as the `ik` table.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn with_camargo_forces(self, what: &str, text: &str, column: &str) -> Result<Self, ModelError> {
        self.with_force(what, &camargo_table(what, text)?, column)
    }

    fn with_force(mut self, what: &str, table: &Table, column: &str) -> Result<Self, ModelError> {
        self.right_force = Some(VerticalForce::of(table, column)?);
        self.steps.push(format!("{what}: {} rows, {column} is the force under the right foot", table.len()));
        Ok(self)
    }

    /// Parses a table exported from the data set of Camargo et al. 2021 (J Biomech 119:110320): the `data` table of the
    /// `ik` file of a trial, written with MATLAB's `writetable(data, 'trial.csv')`. The first column is `Header` (s);
    /// angles are in degrees and have OpenSim's names.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_camargo_csv(what: &str, text: &str) -> Result<Self, ModelError> {
        let table = camargo_table(what, text)?;
        let mut steps =
            vec![format!("{what}: Camargo 2021 inverse kinematics, {} rows, angles in degrees", table.len())];
        Self::from_opensim_columns(what, &table, AngleUnit::Degrees.in_radians(), None, &mut steps)
    }

    /// Parses Gaitwright's table: `time_s,torso_rad,hip_L_rad,knee_L_rad,ankle_L_rad,hip_R_rad`, optionally
    /// `knee_R_rad` and `right_force_n`. Forward lean, flexion and dorsiflexion are positive; hip angles are relative
    /// to the torso. Lines that begin with `#` before the names become provenance.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_csv(what: &str, text: &str) -> Result<Self, ModelError> {
        let lines = lines_of(text);
        let comments = lines.iter().take_while(|line| line.starts_with('#')).count();
        let table =
            Table::read(what, &lines[comments..], comments + 1, Separator::Comma, TimeColumn::Column("time_s"))?;
        let mut steps: Vec<String> =
            lines[..comments].iter().map(|line| line.trim_start_matches('#').trim().to_owned()).collect();
        steps.push(format!("{what}: CSV table in Gaitwright's sign convention, {} rows", table.len()));
        let columns = REFERENCE_COLUMNS.map(|name| table.column(name));
        let mut angles = Vec::with_capacity(columns.len());
        for column in columns {
            angles.push(column?);
        }
        let force = table.find("right_force_n").map(|force_n| VerticalForce { time_s: table.times(), force_n });
        Self::whole(what, &table, &angles, table.find("knee_R_rad"), force, steps)
    }

    /// Whether a file has the names that [`Self::from_csv`] reads.
    pub fn has_names_of_csv(file: &AngleTable) -> bool {
        file.has("time_s", &REFERENCE_COLUMNS)
    }

    /// Whether a file has the names that [`Self::from_opensim`] reads.
    pub fn has_names_of_opensim(file: &AngleTable) -> bool {
        file.has("time", &OPENSIM_COLUMNS)
    }

    /// Whether a file has the names that [`Self::from_camargo_csv`] reads.
    pub fn has_names_of_camargo(file: &AngleTable) -> bool {
        file.has("Header", &OPENSIM_COLUMNS)
    }

    /// The angles of a file whose columns were chosen. `force_column`, if given, is the vertical force under the right foot.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] for an angle without a column, or with line and column.
    pub fn from_columns(
        what: &str,
        file: &AngleTable,
        unit: AngleUnit,
        columns: &[AngleColumn<'_>],
        force_column: Option<&str>,
    ) -> Result<Self, ModelError> {
        let of_joint = |joint: &str| columns.iter().find(|column| column.joint == joint);
        let mut angles = Vec::with_capacity(REFERENCE_COLUMNS.len());
        for name in REFERENCE_COLUMNS {
            let joint = name.trim_end_matches("_rad");
            let column = of_joint(joint).ok_or_else(|| ModelError::Malformed {
                what: "columns".to_owned(),
                reason: format!("{joint} has no column"),
            })?;
            angles.push(file.angle(column, unit)?);
        }
        let knee_r_rad = of_joint("knee_R").map(|column| file.angle(column, unit)).transpose()?;
        let force = force_column.map(|name| VerticalForce::of(file.table(), name)).transpose()?;
        Self::whole(what, file.table(), &angles, knee_r_rad, force, file.steps(what, columns, unit))
    }

    /// Converts the columns of OpenSim's gait models: pelvis_tilt and lumbar_extension are positive backwards,
    /// knee_angle is negative in flexion, and hip angles are relative to the pelvis.
    fn from_opensim_columns(
        what: &str,
        table: &Table,
        scale: f64,
        force_column: Option<&str>,
        steps: &mut Vec<String>,
    ) -> Result<Self, ModelError> {
        let angle = |name: &str| table.column(name).map(|c| c.into_iter().map(|v| v * scale).collect::<Vec<f64>>());
        let pelvis = angle("pelvis_tilt")?;
        let lumbar = if let Some(column) = table.find("lumbar_extension") {
            steps.push("torso lean = -(pelvis_tilt + lumbar_extension)".to_owned());
            steps.push("hip relative to the torso = hip_flexion - lumbar_extension".to_owned());
            column.into_iter().map(|v| v * scale).collect()
        } else {
            steps.push("no column lumbar_extension: the torso moves with the pelvis, hip = hip_flexion".to_owned());
            vec![0.0; table.len()]
        };
        steps.push("knee flexion = -knee_angle".to_owned());
        let rows = 0..table.len();
        let from_torso = |hip: &[f64]| hip.iter().zip(&lumbar).map(|(h, l)| h - l).collect::<Vec<f64>>();
        let flipped = |knee: Vec<f64>| knee.into_iter().map(|k| -k).collect::<Vec<f64>>();
        let angles = [
            rows.map(|k| -(pelvis[k] + lumbar[k])).collect(),
            from_torso(&angle("hip_flexion_l")?),
            flipped(angle("knee_angle_l")?),
            angle("ankle_angle_l")?,
            from_torso(&angle("hip_flexion_r")?),
        ];
        let knee = table.find("knee_angle_r").map(|c| c.into_iter().map(|v| -v * scale).collect());
        let force = force_column.map(|name| VerticalForce::of(table, name)).transpose()?;
        Self::whole(what, table, &angles, knee, force, std::mem::take(steps))
    }

    fn whole(
        what: &str,
        table: &Table,
        angles: &[Vec<f64>],
        knee_r_rad: Option<Vec<f64>>,
        right_force: Option<VerticalForce>,
        steps: Vec<String>,
    ) -> Result<Self, ModelError> {
        for (column, name) in angles.iter().zip(REFERENCE_COLUMNS) {
            if let Some(row) = column.iter().position(|a| a.abs() > MAX_ANGLE_RAD) {
                let angle = column[row];
                let reason = format!(
                    "{name} is {angle:.1} rad; plausible angles are at most {MAX_ANGLE_RAD:.2} rad in either direction; check the unit"
                );
                return Err(table.malformed_row(row, None, reason));
            }
        }
        if let Some(reason) = Self::no_knee(&angles[KNEE]) {
            return Err(table.malformed_row(0, None, format!("{} {reason}", REFERENCE_COLUMNS[KNEE])));
        }
        let time_s = table.times();
        for (column, name) in angles.iter().zip(REFERENCE_COLUMNS) {
            if let Some((row, jump_rad)) = Self::jump(&time_s, column) {
                let reason = format!("{name} jumps by {jump_rad:.2} rad in {:.4} s", time_s[row] - time_s[row - 1]);
                return Err(table.malformed_row(row, None, reason));
            }
        }
        let angles_rad = (0..table.len()).map(|k| std::array::from_fn(|i| angles[i][k])).collect();
        Ok(Self { what: what.to_owned(), time_s, angles_rad, knee_r_rad, right_force, steps })
    }

    /// The reason why an angle is not that of a walking knee with flexion positive, if any.
    pub(crate) fn no_knee(flexion_rad: &[f64]) -> Option<String> {
        still_knee(flexion_rad).or_else(|| backward_knee(flexion_rad))
    }

    /// The first row at which an angle jumps faster than plausible, and the size of the jump, rad.
    pub(crate) fn jump(time_s: &[f64], angle_rad: &[f64]) -> Option<(usize, f64)> {
        (1..angle_rad.len())
            .map(|row| (row, angle_rad[row] - angle_rad[row - 1]))
            .find(|&(row, jump_rad)| jump_rad.abs() > MAX_SPEED_RAD_S * (time_s[row] - time_s[row - 1]))
    }
}

/// The reason why an angle is not that of a walking knee: its range is too small.
fn still_knee(flexion_rad: &[f64]) -> Option<String> {
    let (lowest, highest) = extremes(flexion_rad);
    let range = highest - lowest;
    (range < MIN_KNEE_RANGE_RAD)
        .then(|| format!("moves by only {range:.3} rad, less than {MIN_KNEE_RANGE_RAD} rad; check the unit"))
}

/// The reason why an angle is not that of a walking knee: flexion is negative.
fn backward_knee(flexion_rad: &[f64]) -> Option<String> {
    let (lowest, highest) = extremes(flexion_rad);
    (lowest + highest < 0.0).then(|| {
        format!(
            "ranges from {lowest:.2} to {highest:.2} rad, but flexion must be positive; check the sign of the knee angle"
        )
    })
}

/// Parses a table of Camargo et al. 2021, whose first column is the time in s.
fn camargo_table(what: &str, text: &str) -> Result<Table, ModelError> {
    let lines = lines_of(text);
    Table::read(what, &lines, 1, Separator::Comma, TimeColumn::Column("Header"))
}
