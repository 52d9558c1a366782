//! Imports reference gaits from recordings of joint angles. For pages, REST and the command line.

use super::angle_columns::{self, ChosenColumn, ChosenColumns};
use crate::error::{Error, FieldError};
use crate::printable;
use gait_optimizer::ReferenceGait as Definition;
use gait_optimizer::angle_table::AngleTable;
use gait_optimizer::reference::{AngleUnit, HeelStrikes, MeasuredPerson, MotionRecording};
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::reference_gaits::{self, ReferenceGaitRow};
use gaitwright_store::{Store, Writer};
use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

/// Maximum length of a name, characters.
const MAX_NAME: usize = 200;
/// Column of the vertical force under the right foot in OpenSim's examples.
const FORCE_COLUMN: &str = "ground_force_vy";
/// Column of the vertical force under the right foot in the `fp` tables of Camargo 2021.
const CAMARGO_FORCE_COLUMN: &str = "Treadmill_R_vy";
/// Names of the two files of a form or a request.
pub(super) const RECORDING: &str = "recording";
pub(super) const FORCES: &str = "forces";
/// Maximum length of the provenance, which includes the comments of the recording.
const MAX_PROVENANCE_BYTES: usize = 20_000;

/// File format of a recording of joint angles: `opensim`, a motion or storage file (.mot, .sto) of a gait model;
/// `camargo`, the `data` table of an `ik` file from the Camargo 2021 data set, as CSV; `csv`, a CSV file as
/// `/help/data-files` describes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JointAngleFormat {
    /// OpenSim motion or storage file (.mot, .sto) of a gait model.
    #[default]
    Opensim,
    /// The `data` table of an `ik` file from the Camargo 2021 data set, exported as CSV with MATLAB's writetable.
    Camargo,
    /// CSV: time_s, torso_rad, hip_L_rad, knee_L_rad, ankle_L_rad, hip_R_rad; optionally knee_R_rad, right_force_n.
    Csv,
}

/// Unit of angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// Degrees.
    Degrees,
    /// Radians.
    Radians,
}

impl From<Unit> for AngleUnit {
    fn from(unit: Unit) -> Self {
        match unit {
            Unit::Degrees => Self::Degrees,
            Unit::Radians => Self::Radians,
        }
    }
}

impl From<AngleUnit> for Unit {
    fn from(unit: AngleUnit) -> Self {
        match unit {
            AngleUnit::Degrees => Self::Degrees,
            AngleUnit::Radians => Self::Radians,
        }
    }
}

/// How to find right heel strikes: `force`, where the vertical force under the right foot rises above 20 N; `kinematics`,
/// where the right heel is farthest ahead of the pelvis; `ends`, at the first and the last row of a recording of one
/// stride.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Strikes {
    /// From the vertical force.
    Force,
    /// From the position of the heel.
    #[default]
    Kinematics,
    /// The ends of a recording that is one stride, like an exported gait.
    Ends,
}

/// A recording that becomes a reference gait.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewReferenceGait {
    /// Name shown to users.
    pub name: String,
    /// File format of the recording.
    #[serde(default)]
    pub format: JointAngleFormat,
    /// Content of the file.
    pub recording: String,
    /// Unit of angles, if the header of an OpenSim file does not state it.
    #[serde(default)]
    pub unit: Option<Unit>,
    /// Column of each angle of a file whose columns have other names or signs: of torso, left leg and right hip and, to find
    /// heel strikes from joint angles, of the right knee. Then the first column is the time, s, under any name; a CSV file needs
    /// `unit`; and hip angles are relative to the torso. If empty, the columns have the names of the format.
    #[serde(default)]
    #[schema(value_type = BTreeMap<String, ChosenColumn>)]
    pub columns: ChosenColumns,
    /// Column of the vertical force under the right foot. With `forces`, defaults to `ground_force_vy`, or to
    /// `Treadmill_R_vy` for Camargo 2021.
    #[serde(default)]
    pub force_column: Option<String>,
    /// Content of a separate file with the force column: an OpenSim file, or the `fp` table that belongs to an `ik`
    /// table of the Camargo 2021 data set. Both files must have the same time axis.
    #[serde(default)]
    pub forces: Option<String>,
    /// How to find right heel strikes if `heel_strikes_s` is empty.
    #[serde(default)]
    pub strikes: Strikes,
    /// Times of right heel strikes, s. If empty, they are detected.
    #[serde(default)]
    pub heel_strikes_s: Vec<f64>,
    /// Height of the measured person, m.
    #[serde(default)]
    pub height_m: Option<f64>,
    /// Body mass of the measured person, kg.
    #[serde(default)]
    pub body_mass_kg: Option<f64>,
}

impl NewReferenceGait {
    /// Cuts the recording at heel strikes and averages the strides. `what` and `forces` name the two files in errors
    /// and in the provenance.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the field, or line and column, and the reason.
    pub fn definition(&self, what: &str, forces: &str) -> Result<Definition, Error> {
        self.definition_of(&self.motion(what, forces)?)
    }

    /// Checks what needs no look into the recording: the measured person and, unless the recording is only previewed, the
    /// name.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub fn check_person(&self, is_preview: bool) -> Result<(), Error> {
        if !is_preview {
            printable::name("name", &self.name, MAX_NAME)?;
        }
        Ok(self.walker().validate()?)
    }

    fn walker(&self) -> MeasuredPerson {
        MeasuredPerson { height_m: self.height_m, body_mass_kg: self.body_mass_kg }
    }

    /// Reads the recording, and its forces.
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column.
    pub(super) fn motion(&self, what: &str, forces: &str) -> Result<MotionRecording, Error> {
        let recording = match self.format {
            _ if !self.columns.is_empty() => self.with_columns(what)?,
            JointAngleFormat::Opensim => {
                let unit = self.unit.map(AngleUnit::from);
                let here = self.force_column.as_deref().filter(|_| self.forces.is_none());
                MotionRecording::from_opensim(what, &self.recording, unit, here)?
            }
            JointAngleFormat::Camargo => MotionRecording::from_camargo_csv(what, &self.recording)?,
            JointAngleFormat::Csv => MotionRecording::from_csv(what, &self.recording)?,
        };
        Ok(match &self.forces {
            Some(text) => {
                let column = self.force_column.as_deref();
                match self.format {
                    JointAngleFormat::Camargo => {
                        recording.with_camargo_forces(forces, text, column.unwrap_or(CAMARGO_FORCE_COLUMN))?
                    }
                    JointAngleFormat::Opensim | JointAngleFormat::Csv => {
                        recording.with_force_file(forces, text, column.unwrap_or(FORCE_COLUMN))?
                    }
                }
            }
            None => recording,
        })
    }

    /// Reads the recording with the columns that were chosen.
    fn with_columns(&self, what: &str) -> Result<MotionRecording, Error> {
        let columns = angle_columns::columns_of("columns", &self.columns)?;
        angle_columns::check_complete("columns", &self.columns)?;
        let file = self.table(what)?;
        let degrees = (self.format == JointAngleFormat::Camargo).then_some(AngleUnit::Degrees);
        let unit = angle_columns::unit_of("unit", &file, self.unit.map(AngleUnit::from).or(degrees))?;
        let here = self.force_column.as_deref().filter(|_| self.forces.is_none());
        Ok(MotionRecording::from_columns(what, &file, unit, &columns, here)?)
    }

    /// The file with any names of columns.
    pub(super) fn table(&self, what: &str) -> Result<AngleTable, Error> {
        Ok(match self.format {
            JointAngleFormat::Opensim => AngleTable::from_opensim(what, &self.recording)?,
            JointAngleFormat::Camargo | JointAngleFormat::Csv => AngleTable::from_csv(what, &self.recording)?,
        })
    }

    /// How the heel strikes are found.
    pub(super) fn heel_strikes(&self) -> HeelStrikes {
        match self.strikes {
            _ if !self.heel_strikes_s.is_empty() => HeelStrikes::Given(self.heel_strikes_s.clone()),
            Strikes::Force => HeelStrikes::Force,
            Strikes::Kinematics => HeelStrikes::Kinematics,
            Strikes::Ends => HeelStrikes::Ends,
        }
    }

    /// Cuts a recording at heel strikes and averages the strides.
    pub(super) fn definition_of(&self, recording: &MotionRecording) -> Result<Definition, Error> {
        let name = printable::name("name", &self.name, MAX_NAME)?;
        let definition = recording.reference(name, &self.heel_strikes(), self.walker())?;
        if definition.provenance.len() > MAX_PROVENANCE_BYTES {
            let allowed = format!("a file with at most {MAX_PROVENANCE_BYTES} bytes of comments above its columns");
            let given = format!("a file with {} bytes of comments", definition.provenance.len());
            return Err(FieldError::described("recording", &given, &allowed).into());
        }
        Ok(definition)
    }

    /// The same on the thread pool, because a long recording takes seconds.
    ///
    /// # Errors
    /// As [`Self::definition`].
    pub async fn definition_on_pool(self, store: &mut Store) -> Result<Definition, Error> {
        store.compute(move |_| self.definition(RECORDING, FORCES)).await?
    }
}

/// Checks the name and the provenance of a reference gait.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(super) fn check(definition: &Definition) -> Result<(), Error> {
    printable::name("name", &definition.name, MAX_NAME)?;
    if definition.provenance.len() > MAX_PROVENANCE_BYTES {
        let allowed = format!("at most {MAX_PROVENANCE_BYTES} bytes long");
        let given = format!("{} bytes long", definition.provenance.len());
        return Err(FieldError::described("provenance", &given, &allowed).into());
    }
    Ok(definition.validate()?)
}

/// Adds a reference gait, or returns the identical one that is already on record.
///
/// # Errors
/// [`Error::Invalid`] for a name that does not print; errors of the database.
pub async fn add(
    writer: &mut Writer,
    actor: &Actor,
    definition: &Definition,
) -> Result<(ReferenceGaitRow, bool), Error> {
    writer.check_free_space()?;
    check(definition)?;
    let (reference, added) = reference_gaits::ensure(writer, definition).await?;
    if added {
        let detail =
            json!({ "name": reference.name, "height_m": definition.height_m, "body_mass_kg": definition.body_mass_kg });
        let target = format!("reference gait {}", reference.id);
        audit::append(writer, actor, "reference_gait.import", &target, &detail).await?;
    }
    Ok((reference, added))
}
