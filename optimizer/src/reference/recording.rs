//! A recording of joint angles over several strides, in the walker's convention, with what was done to get there.

use super::LARGEST_ANGLE_RAD;
use crate::opensim::{AngleUnit, StorageFile};
use crate::subject::ModelError;
use crate::table::{Clock, Separator, Table, lines_of};

/// Place of the left knee among the reference's angles.
const KNEE: usize = 2;
/// A knee that walks bends over more than this, rad; one in radians that was read as degrees does not.
const SMALLEST_KNEE_RANGE_RAD: f64 = 0.1;
/// No joint turns faster between two rows, rad/s: walking reaches about 7 (a swinging knee), noise of markers some more.
const LARGEST_SPEED_RAD_S: f64 = 40.0;

/// Joint angles over time: torso, hip_L, knee_L, ankle_L, hip_R, rad, of the seven-link walker.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Name of the file.
    pub what: String,
    /// s.
    pub time_s: Vec<f64>,
    /// One row per time.
    pub angles_rad: Vec<[f64; 5]>,
    /// Right knee, where it was recorded, rad: for finding heel strikes.
    pub knee_r_rad: Option<Vec<f64>>,
    /// Vertical force under the right foot, where it was recorded.
    pub right_force: Option<VerticalForce>,
    /// What was done, step by step.
    pub steps: Vec<String>,
}

/// A vertical force over its own times: force plates are often sampled more densely than markers.
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

impl Recording {
    /// An OpenSim motion or storage file (.mot, .sto) of a gait model: `inDegrees` says the unit (`unit` where it does
    /// not), columns by OpenSim's names; `force_column`, if given, is the vertical force under the right foot.
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
        let mut steps = vec![format!("{what}: OpenSim motion file, {} rows, angles in {unit:?}", table.len())];
        Self::from_opensim_columns(what, &table, unit.in_radians(), force_column, &mut steps)
    }

    /// The recording with the vertical force under the right foot from an OpenSim file of its own, as `subject01_grf.mot`;
    /// both files have one clock.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn with_force_file(self, what: &str, text: &str, column: &str) -> Result<Self, ModelError> {
        self.with_force(what, &StorageFile::read(what, text)?.table, column)
    }

    /// The same from the `fp` table of the trial of Camargo et al. 2021, written as its `ik` table was.
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

    /// A table exported from the data set of Camargo et al. 2021 (J Biomech 119:110320): the `data` table of a trial's
    /// `ik` file written with MATLAB's `writetable(data, 'trial.csv')`. First column `Header` (s), angles in degrees
    /// under OpenSim's names.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_camargo_csv(what: &str, text: &str) -> Result<Self, ModelError> {
        let table = camargo_table(what, text)?;
        let mut steps =
            vec![format!("{what}: Camargo 2021 inverse kinematics, {} rows, angles in degrees", table.len())];
        Self::from_opensim_columns(what, &table, AngleUnit::Degrees.in_radians(), None, &mut steps)
    }

    /// Our own table: `time_s,torso_rad,hip_L_rad,knee_L_rad,ankle_L_rad,hip_R_rad`, optionally `knee_R_rad` and
    /// `right_force_n`, in the walker's convention (forward lean, flexion, dorsiflexion positive; hips from the trunk).
    /// Lines that begin with `#` before the header are kept as provenance.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_csv(what: &str, text: &str) -> Result<Self, ModelError> {
        let lines = lines_of(text);
        let comments = lines.iter().take_while(|line| line.starts_with('#')).count();
        let table = Table::read(what, &lines[comments..], comments + 1, Separator::Comma, Clock::Column("time_s"))?;
        let mut steps: Vec<String> =
            lines[..comments].iter().map(|line| line.trim_start_matches('#').trim().to_owned()).collect();
        steps.push(format!("{what}: table in the walker's convention, {} rows", table.len()));
        let columns = super::REFERENCE_COLUMNS.map(|name| table.column(name));
        let mut angles = Vec::with_capacity(columns.len());
        for column in columns {
            angles.push(column?);
        }
        let force = table.find("right_force_n").map(|force_n| VerticalForce { time_s: table.times(), force_n });
        Self::whole(what, &table, &angles, table.find("knee_R_rad"), force, steps)
    }

    /// OpenSim's gait models: pelvis_tilt and lumbar_extension backward, knee_angle negative in flexion, hips from the
    /// pelvis.
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
            steps.push("trunk lean = -(pelvis_tilt + lumbar_extension)".to_owned());
            steps.push("hips from the trunk = hip_flexion - lumbar_extension".to_owned());
            column.into_iter().map(|v| v * scale).collect()
        } else {
            steps.push("no lumbar_extension: the pelvis stands for the trunk, hips as recorded".to_owned());
            vec![0.0; table.len()]
        };
        steps.push("knee flexion = -knee_angle".to_owned());
        let rows = 0..table.len();
        let from_trunk = |hip: &[f64]| hip.iter().zip(&lumbar).map(|(h, l)| h - l).collect::<Vec<f64>>();
        let flipped = |knee: Vec<f64>| knee.into_iter().map(|k| -k).collect::<Vec<f64>>();
        let angles = [
            rows.map(|k| -(pelvis[k] + lumbar[k])).collect(),
            from_trunk(&angle("hip_flexion_l")?),
            flipped(angle("knee_angle_l")?),
            angle("ankle_angle_l")?,
            from_trunk(&angle("hip_flexion_r")?),
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
        for (column, name) in angles.iter().zip(super::REFERENCE_COLUMNS) {
            if let Some(row) = column.iter().position(|a| a.abs() > LARGEST_ANGLE_RAD) {
                let angle = column[row];
                let reason = format!("{name} is {angle:.1} rad, beyond {LARGEST_ANGLE_RAD:.2} rad; is the unit right?");
                return Err(table.malformed_row(row, None, reason));
            }
        }
        if let Some(reason) = Self::no_knee(&angles[KNEE]) {
            return Err(table.malformed_row(0, None, format!("{} {reason}", super::REFERENCE_COLUMNS[KNEE])));
        }
        let time_s = table.times();
        for (column, name) in angles.iter().zip(super::REFERENCE_COLUMNS) {
            if let Some((row, jump_rad)) = Self::jump(&time_s, column) {
                let reason = format!("{name} jumps by {jump_rad:.2} rad in {:.4} s", time_s[row] - time_s[row - 1]);
                return Err(table.malformed_row(row, None, reason));
            }
        }
        let angles_rad = (0..table.len()).map(|k| std::array::from_fn(|i| angles[i][k])).collect();
        Ok(Self { what: what.to_owned(), time_s, angles_rad, knee_r_rad, right_force, steps })
    }

    /// The lowest and the highest value.
    pub(crate) fn extremes(values: &[f64]) -> (f64, f64) {
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)))
    }

    /// Why this is no knee that walks, flexion positive.
    pub(crate) fn no_knee(flexion_rad: &[f64]) -> Option<String> {
        still_knee(flexion_rad).or_else(|| backward_knee(flexion_rad))
    }

    /// The first row to which an angle turns faster than any joint does, and by how much, rad.
    pub(crate) fn jump(time_s: &[f64], angle_rad: &[f64]) -> Option<(usize, f64)> {
        (1..angle_rad.len())
            .map(|row| (row, angle_rad[row] - angle_rad[row - 1]))
            .find(|&(row, jump_rad)| jump_rad.abs() > LARGEST_SPEED_RAD_S * (time_s[row] - time_s[row - 1]))
    }
}

/// Why this is no knee that walks: it hardly bends.
fn still_knee(flexion_rad: &[f64]) -> Option<String> {
    let (lowest, highest) = Recording::extremes(flexion_rad);
    let range = highest - lowest;
    (range < SMALLEST_KNEE_RANGE_RAD)
        .then(|| format!("moves over {range:.3} rad only, less than {SMALLEST_KNEE_RANGE_RAD} rad; is the unit right?"))
}

/// Why this is no knee that walks, flexion positive: it is bent backwards, as where a file has the other sign.
fn backward_knee(flexion_rad: &[f64]) -> Option<String> {
    let (lowest, highest) = Recording::extremes(flexion_rad);
    (lowest + highest < 0.0).then(|| {
        format!(
            "is from {lowest:.2} to {highest:.2} rad with flexion positive: the file's knee angle has the other sign"
        )
    })
}

/// A table of Camargo et al. 2021: the first column has the time, s.
fn camargo_table(what: &str, text: &str) -> Result<Table, ModelError> {
    let lines = lines_of(text);
    Table::read(what, &lines, 1, Separator::Comma, Clock::Column("Header"))
}
