//! Measurement files of lab walks (EMG recordings and joint angles): parses, checks and stores uploads.

use super::emg_reading::EmgReading;
use super::file_format::{MeasurementFormat, WHAT, check_file_name};
use super::session::{checked_walk, still_open};
use crate::error::{Error, FieldError};
use crate::studies::angle_columns::{self, ChosenColumn, ChosenColumns};
use crate::studies::reference_import::Unit;
use gait_optimizer::ModelError;
use gait_optimizer::angle_table::AngleTable;
use gait_optimizer::limit_cycle::{JointRecording, LimitCycle};
use gaitwright_compute::{OnPool, Pool};
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::lab_sessions::SessionStep;
use gaitwright_store::measurement_files::{self, MeasurementFile, MeasurementKind, PackedFile};
use gaitwright_store::{Connection, LabSessionId, MeasurementFileId, PackedText, Store, StoreResult, Writer};
use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

/// EMG recording of a walk.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewEmg {
    /// Number of the walk.
    #[schema(minimum = 1, maximum = 3)]
    pub walk: u8,
    /// Content of the file.
    pub recording: String,
    /// How to read the file.
    #[serde(default)]
    pub reading: EmgReading,
}

/// How to read a file with joint angles.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointAngleReading {
    /// File format. A CSV file has `time_s` and any of torso_rad, hip_L_rad, knee_L_rad, ankle_L_rad, hip_R_rad,
    /// knee_R_rad, ankle_R_rad.
    pub format: MeasurementFormat,
    /// Unit of angles, if the header of an OpenSim file does not state it.
    pub unit: Option<Unit>,
    /// Column of each angle of a file whose columns have other names or signs. Then the first column is the time, s, under any
    /// name; a CSV file needs `unit`; and hip angles are relative to the torso. If empty, the columns have the names of the format.
    #[schema(value_type = BTreeMap<String, ChosenColumn>)]
    pub columns: ChosenColumns,
    /// Cut-off frequency of the low-pass filter before differentiation, Hz.
    pub cutoff_hz: f64,
    /// Name of the file, as it is shown.
    #[schema(max_length = 200)]
    pub file_name: Option<String>,
}

impl Default for JointAngleReading {
    fn default() -> Self {
        Self {
            format: MeasurementFormat::default(),
            unit: None,
            columns: ChosenColumns::new(),
            cutoff_hz: 6.0,
            file_name: None,
        }
    }
}

impl JointAngleReading {
    /// The limit cycles of a file.
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column, or the field.
    pub fn limit_cycles(&self, text: &str) -> Result<Vec<LimitCycle>, Error> {
        self.joints(text)?.limit_cycles(self.cutoff_hz).map_err(|error| match error {
            ModelError::OutOfRange { .. } => FieldError::from(error).within("reading").into(),
            other => other.into(),
        })
    }

    pub(super) fn joints(&self, text: &str) -> Result<JointRecording, Error> {
        if !self.columns.is_empty() {
            let columns = angle_columns::columns_of("reading.columns", &self.columns)?;
            let file = self.table(text)?;
            let unit = angle_columns::unit_of("reading.unit", &file, self.unit.map(Into::into))?;
            return Ok(JointRecording::from_columns(&file, unit, &columns)?);
        }
        Ok(match self.format {
            MeasurementFormat::Csv => JointRecording::from_csv(WHAT, text)?,
            MeasurementFormat::Opensim => JointRecording::from_opensim(WHAT, text, self.unit.map(Into::into))?,
        })
    }

    /// The file with any names of columns.
    pub(super) fn table(&self, text: &str) -> Result<AngleTable, ModelError> {
        match self.format {
            MeasurementFormat::Csv => AngleTable::from_csv(WHAT, text),
            MeasurementFormat::Opensim => AngleTable::from_opensim(WHAT, text),
        }
    }

    /// Checks that a file gives a limit cycle and limit cycles with these settings.
    pub(super) fn check(&self, text: &str) -> Result<(), Error> {
        self.faults(text).into_iter().next().map_or(Ok(()), Err)
    }

    /// Everything that speaks against a file, as far as one fault does not hide another one.
    pub(super) fn faults(&self, text: &str) -> Vec<Error> {
        let name = check_file_name(self.file_name.as_deref());
        let walking = self.joints(text).and_then(|joints| Ok(joints.check_walking(WHAT)?));
        // A file that cannot be read hides its limit of the cut-off.
        let cutoff = match self.limit_cycles(text) {
            Err(Error::Invalid(fault)) if fault.field != WHAT => Err(Error::Invalid(fault)),
            Err(error) if walking.is_ok() => Err(error),
            _ => Ok(()),
        };
        [name, walking, cutoff].into_iter().filter_map(Result::err).collect()
    }
}

/// Joint angles of a walk.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewJointAngles {
    /// Number of the walk.
    #[schema(minimum = 1, maximum = 3)]
    pub walk: u8,
    /// Content of the file.
    pub recording: String,
    /// How to read the file.
    #[serde(default)]
    pub reading: JointAngleReading,
}

/// A checked measurement file, ready to be stored.
#[derive(Debug)]
pub struct CheckedFile {
    walk: u8,
    packed: PackedFile,
}

impl NewEmg {
    /// Reads and checks the file on the thread pool.
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column, or the field.
    pub async fn checked(self, store: &mut Store) -> Result<CheckedFile, Error> {
        self.checked_wholly(store).await?.map_err(first)
    }

    /// The same with every fault, for forms.
    ///
    /// # Errors
    /// If the file cannot be packed.
    pub async fn checked_wholly(self, store: &mut Store) -> Result<Result<CheckedFile, Vec<Error>>, Error> {
        let check = move |pool: &OnPool| {
            let faults = self.reading.faults(&self.recording);
            let pack = || PackedFile::new(pool, MeasurementKind::Emg, &self.reading, &self.recording);
            checked(self.walk, faults, pack)
        };
        store.compute(check).await?
    }
}

impl NewJointAngles {
    /// Reads and checks the file on the thread pool.
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column, or the field.
    pub async fn checked(self, store: &mut Store) -> Result<CheckedFile, Error> {
        self.checked_wholly(store).await?.map_err(first)
    }

    /// The same with every fault, for forms.
    ///
    /// # Errors
    /// If the file cannot be packed.
    pub async fn checked_wholly(self, store: &mut Store) -> Result<Result<CheckedFile, Vec<Error>>, Error> {
        let check = move |pool: &OnPool| {
            let faults = self.reading.faults(&self.recording);
            let pack = || PackedFile::new(pool, MeasurementKind::JointAngles, &self.reading, &self.recording);
            checked(self.walk, faults, pack)
        };
        store.compute(check).await?
    }
}

fn checked(
    walk: u8,
    faults: Vec<Error>,
    pack: impl FnOnce() -> StoreResult<PackedFile>,
) -> Result<Result<CheckedFile, Vec<Error>>, Error> {
    let faults: Vec<Error> = checked_walk(walk).err().into_iter().chain(faults).collect();
    if faults.is_empty() { Ok(Ok(CheckedFile { walk, packed: pack()? })) } else { Ok(Err(faults)) }
}

/// The first fault, for requests of programs.
fn first(faults: Vec<Error>) -> Error {
    faults.into_iter().next().unwrap_or_else(|| Error::Internal("a file was refused without a reason".to_owned()))
}

/// Checks a stored measurement file like a new upload.
///
/// # Errors
/// [`Error::Invalid`] with line and column, or the field.
pub async fn check_kept(db: &mut Connection, pool: &Pool, kept: &MeasurementFile) -> Result<(), Error> {
    let id = kept.id;
    match kept.kind {
        MeasurementKind::Emg => {
            let (reading, file) = measurement_files::file::<EmgReading>(db, id).await?;
            pool.run(move |pool| reading.check(&file.text(pool)?)).await?
        }
        MeasurementKind::JointAngles => {
            let (reading, file) = measurement_files::file::<JointAngleReading>(db, id).await?;
            pool.run(move |pool| reading.check(&file.text(pool)?)).await?
        }
    }
}

/// A measurement file as uploaded, byte for byte.
#[derive(Debug)]
pub struct UploadedFile {
    /// Its row in the record.
    pub recording: MeasurementFile,
    /// Its format.
    pub format: MeasurementFormat,
    /// Its content.
    pub file: PackedText,
}

/// Reads a measurement file as uploaded.
///
/// # Errors
/// [`Error::NotFound`], or an error if the file does not match its hash.
pub async fn read_upload(db: &mut Connection, id: MeasurementFileId) -> Result<UploadedFile, Error> {
    /// The reading parameter that both kinds have in common.
    #[derive(Deserialize)]
    struct ReadingFormat {
        format: MeasurementFormat,
    }
    let recording = measurement_files::get(db, id).await?;
    let (ReadingFormat { format }, file) = measurement_files::file(db, id).await?;
    Ok(UploadedFile { recording, format, file })
}

/// Stores a measurement file with its walk.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if the session is closed, the walk is not recorded yet, or the same file
/// was uploaded for another walk.
pub async fn store_upload(
    writer: &mut Writer,
    actor: &Actor,
    id: LabSessionId,
    checked: &CheckedFile,
) -> Result<MeasurementFile, Error> {
    writer.check_free_space()?;
    let walk = checked.walk;
    if still_open(writer, id).await?.done(SessionStep::Walk(walk)).is_none() {
        return Err(Error::conflict(format!("Walk {walk} is not recorded yet. Record it in the lab session first.")));
    }
    let brought = measurement_files::of_session(writer, id).await?;
    if let Some(other) = brought.iter().find(|other| other.walk != walk && checked.packed.is_file_of(other)) {
        let other = other.walk;
        return Err(Error::conflict(format!(
            "The same file was already uploaded for walk {other}. Choose the file of this walk."
        )));
    }
    let added = measurement_files::insert(writer, actor, id, walk, &checked.packed).await?;
    let detail = json!({ "walk": walk, "kind": added.kind, "recording": added.id, "sha256": added.raw_sha256 });
    audit::append(writer, actor, "lab_session.upload", &format!("lab session {id}"), &detail).await?;
    Ok(added)
}
