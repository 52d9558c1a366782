//! Measurement files of lab walks (EMG recordings and joint angles): parses, checks and stores uploads.

use super::session::{checked_walk, still_open};
use crate::error::{Error, FieldError};
use crate::printable;
use crate::studies::reference_import::Unit;
use gait_optimizer::ModelError;
use gait_optimizer::emg::{CHANNELS, CycleActivity, EmgRecording, Envelope, strides_between};
use gait_optimizer::phase_portrait::{JointRecording, PhasePortrait};
use gaitwright_compute::{OnPool, Pool};
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::lab_sessions::SessionStep;
use gaitwright_store::measurement_files::{self, MeasurementFile, MeasurementKind, PackedFile};
use gaitwright_store::{Connection, LabSessionId, MeasurementFileId, PackedText, Store, Writer};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// Name of an uploaded file in errors.
pub(super) const WHAT: &str = "recording";

/// Format of a measurement file: `csv`, comma-separated values with column names in the first line; `opensim`, a motion
/// or storage file (.mot, .sto).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeasurementFormat {
    /// Comma-separated values, with column names in the first line that is not a comment.
    #[default]
    Csv,
    /// OpenSim motion or storage file (.mot, .sto).
    Opensim,
}

/// How to read an EMG recording.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EmgReading {
    /// File format.
    pub format: MeasurementFormat,
    /// Sampling rate of a CSV file without a `time_s` column, Hz.
    #[schema(minimum = 100, maximum = 20000)]
    pub rate_hz: Option<f64>,
    /// Column of each channel (RF_L, TA_L, BF_L, GAS_L, RF_R, BF_R). By default the columns have the names of the
    /// channels.
    pub channels: BTreeMap<String, String>,
    /// Times of right heel strikes, s, on the time axis of the file. If empty, they are detected in `heel_strike_column`.
    pub heel_strikes_s: Vec<f64>,
    /// Column of a switch under the right heel, or of the vertical force under the right foot.
    pub heel_strike_column: Option<String>,
    /// Value of `heel_strike_column`, in the unit of the column, above which the foot is on the ground.
    pub heel_strike_threshold: f64,
    /// Numbers of strides to leave out, from 1, in the order of the heel strikes.
    pub rejected_strides: Vec<u32>,
    /// Name of the file, as it is shown.
    #[schema(max_length = 200)]
    pub file_name: Option<String>,
}

impl Default for EmgReading {
    fn default() -> Self {
        Self {
            format: MeasurementFormat::default(),
            rate_hz: None,
            channels: BTreeMap::new(),
            heel_strikes_s: Vec::new(),
            heel_strike_column: None,
            heel_strike_threshold: 0.5,
            rejected_strides: Vec::new(),
            file_name: None,
        }
    }
}

impl EmgReading {
    /// Reads channels and heel strikes. `what` names the file in errors.
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column, or the field.
    pub fn read(&self, what: &str, text: &str) -> Result<(EmgRecording, Vec<f64>), Error> {
        if let Some(unknown) = self.channels.keys().find(|name| !CHANNELS.contains(&name.as_str())) {
            return Err(Error::invalid(
                "reading.channels",
                unknown.as_str(),
                &format!("one of {}", CHANNELS.join(", ")),
            ));
        }
        let whole = self.whole(what, text)?;
        let same = CHANNELS.map(|name| (name, name));
        let named = self.channels.iter().map(|(channel, column)| (channel.as_str(), column.as_str()));
        let recording = if self.channels.is_empty() { whole.select(what, same)? } else { whole.select(what, named)? };
        let strikes = self.strikes(what, &whole)?;
        Ok((recording, strikes))
    }

    /// Every column of the file.
    pub(super) fn whole(&self, what: &str, text: &str) -> Result<EmgRecording, Error> {
        Ok(match (self.format, self.rate_hz) {
            (MeasurementFormat::Csv, rate_hz) => EmgRecording::from_csv(what, text, rate_hz)?,
            (MeasurementFormat::Opensim, None) => EmgRecording::from_opensim(what, text)?,
            (MeasurementFormat::Opensim, Some(rate_hz)) => {
                return Err(Error::invalid(
                    "reading.rate_hz",
                    rate_hz,
                    "omitted, because an OpenSim file has its own time axis",
                ));
            }
        })
    }

    /// The right heel strikes, s.
    pub(super) fn strikes(&self, what: &str, whole: &EmgRecording) -> Result<Vec<f64>, Error> {
        Ok(match (&self.heel_strike_column, &self.heel_strikes_s[..]) {
            (Some(column), []) => whole.strikes_of_column(what, column, self.heel_strike_threshold)?,
            (None, given @ [_, _, ..]) => {
                whole.check_strikes(what, given)?;
                given.to_vec()
            }
            (_, given) => {
                let allowed = "at least two heel-strike times, or none if a heel strike column is given";
                return Err(Error::invalid("reading.heel_strikes_s", json!(given), allowed));
            }
        })
    }

    /// The strides, s, without the rejected ones.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a number that no stride has, or if every stride is rejected.
    pub fn kept_strides(&self, heel_strikes_s: &[f64]) -> Result<Vec<(f64, f64)>, Error> {
        let strides = strides_between(heel_strikes_s);
        let numbered = |number: u32| usize::try_from(number).is_ok_and(|number| (1..=strides.len()).contains(&number));
        if let Some(unknown) = self.rejected_strides.iter().find(|number| !numbered(**number)) {
            return Err(Error::invalid("reading.rejected_strides", *unknown, &format!("1 to {}", strides.len())));
        }
        let kept: Vec<(f64, f64)> = strides
            .into_iter()
            .zip(1_u32..)
            .filter(|(_, number)| !self.rejected_strides.contains(number))
            .map(|(stride, _)| stride)
            .collect();
        if kept.is_empty() {
            return Err(FieldError::in_words(
                "reading.rejected_strides",
                "Every stride is rejected. Keep at least one.",
            )
            .into());
        }
        Ok(kept)
    }

    /// Checks that a file has EMG signals and can be cut into strides, for any filter settings.
    pub(super) fn check(&self, text: &str) -> Result<(), Error> {
        check_file_name(self.file_name.as_deref())?;
        let (recording, strikes) = self.read(WHAT, text)?;
        let strides = self.kept_strides(&strikes)?;
        recording.check_channels()?;
        for (channel, values) in recording.channels {
            let raw = Envelope { channel, start_s: recording.start_s, rate_hz: recording.rate_hz, values };
            CycleActivity::of_strides(&raw, &strides)?;
        }
        Ok(())
    }
}

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
    /// Cut-off frequency of the low-pass filter before differentiation, Hz.
    pub cutoff_hz: f64,
    /// Name of the file, as it is shown.
    #[schema(max_length = 200)]
    pub file_name: Option<String>,
}

impl Default for JointAngleReading {
    fn default() -> Self {
        Self { format: MeasurementFormat::default(), unit: None, cutoff_hz: 6.0, file_name: None }
    }
}

impl JointAngleReading {
    /// The phase portraits of a file.
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column, or the field.
    pub fn portraits(&self, text: &str) -> Result<Vec<PhasePortrait>, Error> {
        self.joints(text)?.portraits(self.cutoff_hz).map_err(|error| match error {
            ModelError::OutOfRange { .. } => FieldError::from(error).within("reading").into(),
            other => other.into(),
        })
    }

    fn joints(&self, text: &str) -> Result<JointRecording, Error> {
        Ok(match self.format {
            MeasurementFormat::Csv => JointRecording::from_csv(WHAT, text)?,
            MeasurementFormat::Opensim => JointRecording::from_opensim(WHAT, text, self.unit.map(Into::into))?,
        })
    }

    /// Checks that a file gives a limit cycle and phase portraits with these settings.
    fn check(&self, text: &str) -> Result<(), Error> {
        check_file_name(self.file_name.as_deref())?;
        self.joints(text)?.check_walking(WHAT)?;
        self.portraits(text).map(|_| ())
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

/// Longest name of a file, characters.
const LONGEST_FILE_NAME: usize = 200;

fn check_file_name(name: Option<&str>) -> Result<(), Error> {
    name.map_or(Ok(()), |name| printable::name("reading.file_name", name, LONGEST_FILE_NAME).map(|_| ()))
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
        let check = move |pool: &OnPool| {
            let walk = checked_walk(self.walk)?;
            self.reading.check(&self.recording)?;
            let packed = PackedFile::new(pool, MeasurementKind::Emg, &self.reading, &self.recording)?;
            Ok(CheckedFile { walk, packed })
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
        let check = move |pool: &OnPool| {
            let walk = checked_walk(self.walk)?;
            self.reading.check(&self.recording)?;
            let packed = PackedFile::new(pool, MeasurementKind::JointAngles, &self.reading, &self.recording)?;
            Ok(CheckedFile { walk, packed })
        };
        store.compute(check).await?
    }
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
    /// What is known of it.
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
