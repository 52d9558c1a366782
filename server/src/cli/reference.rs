//! `gaitwright reference`: a reference gait from a recording.

use super::out_file::OutFile;
use super::output::{data, tell};
use super::problem::read;
use crate::error::Error;
use clap::{Args, ValueEnum};
use gait_optimizer::reference::{AngleUnit, HeelStrikes, Recording, Walker};
use std::path::PathBuf;

/// Forms of recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// OpenSim motion or storage file (.mot, .sto) of a gait model.
    Opensim,
    /// The `data` table of an `ik` file of Camargo 2021, written by MATLAB's writetable.
    Camargo,
    /// CSV: time_s, torso_rad, hip_L_rad, knee_L_rad, ankle_L_rad, hip_R_rad; optionally knee_R_rad, right_force_n.
    Csv,
}

/// Units of angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Unit {
    Degrees,
    Radians,
}

/// How right heel strikes are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Strikes {
    /// Where the vertical force under the right foot rises above 20 N.
    Force,
    /// Where the right heel is farthest ahead of the pelvis.
    Kinematics,
}

#[derive(Debug, Args)]
pub(super) struct Reference {
    /// The recording.
    #[arg(value_name = "FILE")]
    recording: PathBuf,
    /// Name shown to people.
    #[arg(long, value_name = "TEXT")]
    name: String,
    /// Form of the recording.
    #[arg(long, value_enum, default_value = "opensim")]
    form: Form,
    /// Unit of an OpenSim file whose header does not say it.
    #[arg(long, value_enum)]
    unit: Option<Unit>,
    /// Column of the vertical force under the right foot in an OpenSim file.
    #[arg(long, value_name = "NAME")]
    force_column: Option<String>,
    /// How right heel strikes are found.
    #[arg(long, value_enum, default_value = "kinematics", conflicts_with = "heel_strikes_s")]
    strikes: Strikes,
    /// Right heel strikes, s, as in 0.41,1.52,2.63.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', allow_negative_numbers = true)]
    heel_strikes_s: Vec<f64>,
    /// Height of the person, for matching.
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    height_m: Option<f64>,
    /// Body mass of the person, for matching.
    #[arg(long, value_name = "KILOGRAMS", allow_negative_numbers = true)]
    mass_kg: Option<f64>,
    /// Where to write the reference (JSON); default: stdout.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Reference {
    pub(super) fn run(self) -> Result<(), Error> {
        let text = read(&self.recording)?;
        let what = self.recording.display().to_string();
        let recording = match self.form {
            Form::Opensim => {
                let unit = self.unit.map(|unit| match unit {
                    Unit::Degrees => AngleUnit::Degrees,
                    Unit::Radians => AngleUnit::Radians,
                });
                Recording::from_opensim(&what, &text, unit, self.force_column.as_deref())?
            }
            Form::Camargo => Recording::from_camargo_csv(&what, &text)?,
            Form::Csv => Recording::from_csv(&what, &text)?,
        };
        let strikes = match self.strikes {
            _ if !self.heel_strikes_s.is_empty() => HeelStrikes::Given(self.heel_strikes_s),
            Strikes::Force => HeelStrikes::Force,
            Strikes::Kinematics => HeelStrikes::Kinematics,
        };
        let walker = Walker { height_m: self.height_m, body_mass_kg: self.mass_kg };
        let reference = recording.reference(&self.name, &strikes, walker)?;
        let out = self.out.as_deref().map(|out| OutFile::open(out, &[&self.recording])).transpose()?;
        let json = serde_json::to_string_pretty(&reference).map_err(|e| Error::Internal(e.to_string()))?;
        tell(&reference.provenance);
        match out {
            Some(out) => out.write(&json),
            None => data(&json),
        }
    }
}
