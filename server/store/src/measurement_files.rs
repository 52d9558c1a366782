//! Stored measurement files of lab sessions, and results of EMG processing.

use super::audit::Actor;
use super::{
    Connection, EmgResultId, Instant, LabSessionId, MeasurementFileId, PackedText, StoreError, StoreResult,
    json_columns, now,
};
use gaitwright_compute::OnPool;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Row};
use std::str::FromStr;
use utoipa::ToSchema;

/// Kind of measurement file: `emg`, an EMG recording; `joint_angles`, joint angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeasurementKind {
    /// EMG recording.
    Emg,
    /// Joint angles.
    JointAngles,
}

impl MeasurementKind {
    /// The name in the record.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Emg => "emg",
            Self::JointAngles => "joint_angles",
        }
    }
}

impl FromStr for MeasurementKind {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::Emg, Self::JointAngles]
            .into_iter()
            .find(|kind| kind.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("kind of a measurement file", text))
    }
}

/// Measurement file, without its content.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasurementFile {
    /// Identifier.
    pub id: MeasurementFileId,
    /// Identifier of the lab session.
    pub lab_session_id: LabSessionId,
    /// Number of the walk, 1 to 3.
    pub walk: u8,
    /// Kind of measurement.
    pub kind: MeasurementKind,
    /// Name of the file, if it is known.
    pub file_name: Option<String>,
    /// SHA-256 of the file.
    pub raw_sha256: String,
    /// Actor of the upload.
    pub actor: String,
    /// Time of the upload.
    pub created_at: Instant,
}

/// A compressed file, ready to be written.
#[derive(Debug)]
pub struct PackedFile {
    kind: MeasurementKind,
    reading: String,
    raw: Vec<u8>,
    raw_sha256: String,
}

impl PackedFile {
    /// Compresses a file; `reading` describes how to read it.
    ///
    /// # Errors
    /// If serialisation fails.
    pub fn new<T: Serialize>(pool: &OnPool, kind: MeasurementKind, reading: &T, file: &str) -> StoreResult<Self> {
        Ok(Self {
            kind,
            reading: json_columns::to_text("reading instructions of a measurement file", reading)?,
            raw: json_columns::compress(pool, "recording", file.as_bytes())?,
            raw_sha256: json_columns::sha256(file.as_bytes()),
        })
    }

    /// The name of the file, which is part of the reading instructions.
    fn file_name(&self) -> StoreResult<Option<String>> {
        #[derive(Deserialize)]
        struct Reading {
            #[serde(default)]
            file_name: Option<String>,
        }
        let reading: Reading = json_columns::from_text("reading instructions of a measurement file", &self.reading)?;
        Ok(reading.file_name)
    }

    /// Whether it is identical to a stored file of the same kind.
    pub fn is_file_of(&self, recording: &MeasurementFile) -> bool {
        (self.kind, &self.raw_sha256) == (recording.kind, &recording.raw_sha256)
    }
}

/// Adds a file.
///
/// # Errors
/// A violated constraint; errors of the database.
pub async fn insert(
    db: &mut Connection,
    actor: &Actor,
    session: LabSessionId,
    walk: u8,
    packed: &PackedFile,
) -> StoreResult<MeasurementFile> {
    let added = MeasurementFile {
        id: MeasurementFileId::fresh(),
        lab_session_id: session,
        walk,
        kind: packed.kind,
        file_name: packed.file_name()?,
        raw_sha256: packed.raw_sha256.clone(),
        actor: actor.as_str().to_owned(),
        created_at: now(),
    };
    sqlx::query(
        "insert into measurement_files (id, lab_session_id, walk, kind, reading, raw, raw_sha256, actor, created_at) \
         values (?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(added.id)
    .bind(session)
    .bind(walk)
    .bind(packed.kind.as_str())
    .bind(&packed.reading)
    .bind(&packed.raw[..])
    .bind(&packed.raw_sha256)
    .bind(&added.actor)
    .bind(added.created_at)
    .execute(db)
    .await?;
    Ok(added)
}

/// Selects files without their content.
const SELECT: &str = "select id, lab_session_id, walk, kind, json_extract(reading, '$.file_name') as file_name, raw_sha256, actor, created_at from measurement_files";

/// The file with this identifier, without its content.
///
/// # Errors
/// [`StoreError::Missing`], or errors of the database.
pub async fn get(db: &mut Connection, id: MeasurementFileId) -> StoreResult<MeasurementFile> {
    let sql = AssertSqlSafe(format!("{SELECT} where id = ?"));
    let row = sqlx::query(sql).bind(id).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()?.ok_or_else(|| missing(id))
}

/// Every file of a session, oldest first, without content.
///
/// # Errors
/// Errors of the database.
pub async fn of_session(db: &mut Connection, session: LabSessionId) -> StoreResult<Vec<MeasurementFile>> {
    let sql = AssertSqlSafe(format!("{SELECT} where lab_session_id = ? order by id"));
    sqlx::query(sql).bind(session).fetch_all(db).await?.iter().map(from_row).collect()
}

fn missing(id: MeasurementFileId) -> StoreError {
    StoreError::Missing { what: "measurement file", id: id.to_string() }
}

/// The content of a file, and how to read it.
///
/// # Errors
/// [`StoreError::Missing`], or errors of the database.
pub async fn file<T: DeserializeOwned>(db: &mut Connection, id: MeasurementFileId) -> StoreResult<(T, PackedText)> {
    let row = sqlx::query("select reading, raw, raw_sha256 from measurement_files where id = ?")
        .bind(id)
        .fetch_optional(db)
        .await?
        .ok_or_else(|| missing(id))?;
    let file = PackedText::new("recording", row.try_get("raw")?, Some(row.try_get("raw_sha256")?));
    Ok((json_columns::column(&row, "reading")?, file))
}

/// Adds a result of EMG processing.
///
/// # Errors
/// If serialisation fails; errors of the database.
pub async fn insert_result<T: Serialize>(
    db: &mut Connection,
    actor: &Actor,
    session: LabSessionId,
    document: &T,
) -> StoreResult<EmgResultId> {
    let id = EmgResultId::fresh();
    sqlx::query("insert into emg_results (id, lab_session_id, document, actor, created_at) values (?, ?, ?, ?, ?)")
        .bind(id)
        .bind(session)
        .bind(json_columns::to_text("EMG result", document)?)
        .bind(actor.as_str())
        .bind(now())
        .execute(db)
        .await?;
    Ok(id)
}

/// The newest result of EMG processing of a session.
///
/// # Errors
/// Errors of the database.
pub async fn newest_result<T: DeserializeOwned>(db: &mut Connection, session: LabSessionId) -> StoreResult<Option<T>> {
    let row = sqlx::query("select document from emg_results where lab_session_id = ? order by id desc limit 1")
        .bind(session)
        .fetch_optional(db)
        .await?;
    row.map(|row| json_columns::column(&row, "document")).transpose()
}

/// Every result of EMG processing of a session, oldest first.
///
/// # Errors
/// Errors of the database.
pub async fn results<T: DeserializeOwned>(db: &mut Connection, session: LabSessionId) -> StoreResult<Vec<T>> {
    let rows = sqlx::query("select document from emg_results where lab_session_id = ? order by id").bind(session);
    rows.fetch_all(db).await?.iter().map(|row| json_columns::column(row, "document")).collect()
}

fn from_row(row: &SqliteRow) -> StoreResult<MeasurementFile> {
    Ok(MeasurementFile {
        id: row.try_get("id")?,
        lab_session_id: row.try_get("lab_session_id")?,
        walk: row.try_get("walk")?,
        kind: row.try_get::<&str, _>("kind")?.parse()?,
        file_name: row.try_get("file_name")?,
        raw_sha256: row.try_get("raw_sha256")?,
        actor: row.try_get("actor")?,
        created_at: row.try_get("created_at")?,
    })
}
