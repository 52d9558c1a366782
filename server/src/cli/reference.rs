//! `gaitwright reference`: computes a reference gait from a recording.

use super::flag_choices::{ANGLE_UNITS, HEEL_STRIKES, JOINT_ANGLE_FORMATS, one_of};
use super::flag_names::of_flags;
use super::flag_numbers::number;
use super::input_file::read;
use super::out_file::OutFile;
use super::output::{data, tell};
use clap::Args;
use gaitwright_service::error::Error;
use gaitwright_service::studies::angle_columns::{ChosenColumn, ChosenColumns};
use gaitwright_service::studies::reference_import::{JointAngleFormat, NewReferenceGait, Strikes, Unit};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct ReferenceCommand {
    /// Recording of joint angles.
    #[arg(value_name = "FILE")]
    recording: PathBuf,
    /// Name shown to users.
    #[arg(long, value_name = "TEXT")]
    name: String,
    /// Format of the recording.
    #[arg(long, value_parser = one_of::<JointAngleFormat>(JOINT_ANGLE_FORMATS), default_value = "opensim")]
    format: JointAngleFormat,
    /// Unit of angles, if the header of an OpenSim file does not state it.
    #[arg(long, value_parser = one_of::<Unit>(ANGLE_UNITS))]
    unit: Option<Unit>,
    /// Columns of the angles of a file with other names, as in torso=Trunk,knee_L="Left knee" (torso, hip_L, knee_L, ankle_L,
    /// hip_R, knee_R). The first column is the time, s; hip angles are relative to the torso.
    #[arg(long, value_name = "JOINT=COLUMN,...", value_delimiter = ',', value_parser = column)]
    columns: Vec<(String, String)>,
    /// Angles among --columns whose sign is opposite to that of the walker: forward lean, flexion and dorsiflexion are positive.
    #[arg(long, value_name = "JOINT,...", value_delimiter = ',', requires = "columns")]
    reversed: Vec<String>,
    /// Column of the vertical force under the right foot (default with --forces: ground_force_vy, or Treadmill_R_vy
    /// with --format camargo).
    #[arg(long, value_name = "NAME")]
    force_column: Option<String>,
    /// Separate file with the force column: an OpenSim file or, with --format camargo, the `fp` table as CSV. Both
    /// files must have the same time axis.
    #[arg(long, value_name = "FILE")]
    forces: Option<PathBuf>,
    /// How to find right heel strikes.
    #[arg(long, value_parser = one_of::<Strikes>(HEEL_STRIKES), default_value = "kinematics", conflicts_with = "heel_strikes_s")]
    strikes: Strikes,
    /// Times of right heel strikes, as in 0.41,1.52,2.63.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', value_parser = number, allow_negative_numbers = true)]
    heel_strikes_s: Vec<f64>,
    /// Height of the measured person, m.
    #[arg(long, value_name = "METRES", value_parser = number, allow_negative_numbers = true)]
    height_m: Option<f64>,
    /// Body mass of the measured person, kg.
    #[arg(long, value_name = "KILOGRAMS", value_parser = number, allow_negative_numbers = true)]
    body_mass_kg: Option<f64>,
    /// JSON output file (default: standard output).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl ReferenceCommand {
    pub(super) fn run(self) -> Result<(), Error> {
        let columns = self.chosen_columns()?;
        let new = NewReferenceGait {
            name: self.name,
            format: self.format,
            recording: read(&self.recording)?,
            unit: self.unit,
            columns,
            force_column: self.force_column,
            forces: self.forces.as_deref().map(read).transpose()?,
            strikes: self.strikes,
            heel_strikes_s: self.heel_strikes_s,
            height_m: self.height_m,
            body_mass_kg: self.body_mass_kg,
        };
        let forces = self.forces.as_ref().map_or_else(String::new, |path| path.display().to_string());
        let flags = [
            ("name", "--name"),
            ("unit", "--unit"),
            ("columns", "--columns"),
            ("heel_strikes_s", "--heel-strikes-s"),
            ("height_m", "--height-m"),
            ("body_mass_kg", "--body-mass-kg"),
        ];
        let reference = new.definition(&self.recording.display().to_string(), &forces);
        let reference = reference.map_err(|error| of_flags(error, &flags))?;
        let inputs: Vec<&Path> =
            [Some(&self.recording), self.forces.as_ref()].into_iter().flatten().map(PathBuf::as_path).collect();
        let out = OutFile::instead_of_stdout(self.out.as_deref(), &inputs)?;
        let json = serde_json::to_string_pretty(&reference).map_err(|e| Error::Internal(e.to_string()))?;
        tell(&reference.provenance);
        match out {
            Some(out) => out.write(&json),
            None => data(&json),
        }
    }

    /// The column of each angle, with its sign.
    fn chosen_columns(&self) -> Result<ChosenColumns, Error> {
        let mut chosen = ChosenColumns::new();
        for (joint, column) in &self.columns {
            let column = ChosenColumn { column: column.clone(), reversed: self.reversed.contains(joint) };
            if chosen.insert(joint.clone(), column).is_some() {
                return Err(Error::invalid("--columns", joint.as_str(), "given once for each angle"));
            }
        }
        match self.reversed.iter().find(|joint| !chosen.contains_key(*joint)) {
            Some(joint) => Err(Error::invalid("--reversed", joint.as_str(), "one of the angles in --columns")),
            None => Ok(chosen),
        }
    }
}

fn column(text: &str) -> Result<(String, String), String> {
    let (joint, column) = text.split_once('=').ok_or("must be JOINT=COLUMN, as in torso=Trunk")?;
    Ok((joint.trim().to_owned(), column.trim().to_owned()))
}
