//! A whole study as one file: every row that belongs to it, as written, with a hash over all of it.
//!
//! The first line is plain JSON (format and SHA-256 of the rest), the rest is zstd-compressed JSON: rows by table.

use super::{Connection, StoreError, StoreResult, StudyId, consents, json, studies};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Column, Row, TypeInfo, ValueRef};
use std::collections::{BTreeMap, HashMap};

/// Format of the files that are written: as 1, and certificates with the version of their examination.
const FORMAT: &str = "gaitwright study 2";
/// Formats that are read.
const READ: [&str; 2] = ["gaitwright study 1", FORMAT];
/// Largest archive that is read, uncompressed.
const LARGEST_BYTES: u64 = 4 << 30;

/// Tables in the order in which their rows can be written, and which rows belong to a study.
const TABLES: [(&str, &str); 26] = [
    ("subjects", "id in (select subject_id from studies where id = ?)"),
    ("devices", "id in (select device_id from studies where id = ?)"),
    ("reference_gaits", "id in (select reference_gait_id from studies where id = ?)"),
    ("studies", "id = ?"),
    ("trials", "study_id = ? order by number"),
    ("gaits", "trial_id in (select id from trials where study_id = ?)"),
    ("certificates", "trial_id in (select id from trials where study_id = ?) order by trial_id, format_version"),
    ("explanation_requests", "trial_id in (select id from trials where study_id = ?)"),
    ("explanations", "trial_id in (select id from trials where study_id = ?)"),
    ("jobs", "trial_id in (select id from trials where study_id = ?)"),
    ("results", "trial_id in (select id from trials where study_id = ?)"),
    ("feedback", "study_id = ? order by seq"),
    ("retractions", "feedback_seq in (select seq from feedback where study_id = ?)"),
    ("presentations", "study_id = ? order by id"),
    ("presentation_answers", "presentation_id in (select id from presentations where study_id = ?)"),
    ("presentation_retractions", "presentation_id in (select id from presentations where study_id = ?)"),
    ("unblindings", "study_id = ? order by seq"),
    ("remarks", "study_id = ? order by id"),
    ("remark_retractions", "remark_id in (select id from remarks where study_id = ?)"),
    ("safety_reviews", "trial_id in (select id from trials where study_id = ?) order by id"),
    ("lab_sessions", "study_id = ? order by number"),
    ("lab_acts", "session_id in (select id from lab_sessions where study_id = ?) order by rowid"),
    ("lab_answers", "session_id in (select id from lab_sessions where study_id = ?) order by rowid"),
    ("lab_answer_retractions", "session_id in (select id from lab_sessions where study_id = ?) order by rowid"),
    ("lab_recordings", "session_id in (select id from lab_sessions where study_id = ?) order by id"),
    ("emg_results", "session_id in (select id from lab_sessions where study_id = ?) order by id"),
];

type Rows = Vec<Map<String, Value>>;

#[derive(Serialize, Deserialize)]
struct Head {
    format: String,
    sha256: String,
}

/// A study as read from an archive, not yet written anywhere.
#[derive(Debug)]
pub struct Archive(BTreeMap<String, Rows>);

/// A study as an archive, every table as of the same instant.
///
/// # Errors
/// [`StoreError::Missing`], [`StoreError::Withdrawn`], or what the database reports.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<u8>> {
    let mut reader = sqlx::Connection::begin(db).await?;
    studies::get(&mut reader, study).await?;
    consents::may_be_shown(&mut reader, study).await?;
    pack(&mut reader, study).await
}

async fn pack(db: &mut Connection, study: StudyId) -> StoreResult<Vec<u8>> {
    let mut tables = BTreeMap::new();
    for (table, belongs) in TABLES {
        let sql = AssertSqlSafe(format!("select * from {table} where {belongs}"));
        let rows = sqlx::query(sql).bind(study).fetch_all(&mut *db).await?;
        tables.insert(table, rows.iter().map(to_json).collect::<StoreResult<Rows>>()?);
    }
    let body = json::compress("archive", json::to_text("archive", &tables)?.as_bytes())?;
    let head = Head { format: FORMAT.to_owned(), sha256: json::sha256(&body) };
    let mut file = json::to_text("archive", &head)?.into_bytes();
    file.push(b'\n');
    file.extend_from_slice(&body);
    Ok(file)
}

/// Reads an archive and checks its hash and shape.
///
/// # Errors
/// [`StoreError::Damaged`] with what is wrong.
pub fn open(file: &[u8]) -> StoreResult<Archive> {
    let damaged = |reason: &str| StoreError::Damaged { what: "archive", reason: reason.to_owned() };
    let end = file.iter().take(1000).position(|byte| *byte == b'\n').ok_or_else(|| damaged("it has no first line"))?;
    let (head, body) = (&file[..end], &file[end + 1..]);
    let head: Head = serde_json::from_slice(head).map_err(|_| damaged("its first line is not that of an archive"))?;
    if !READ.contains(&head.format.as_str()) {
        return Err(damaged(&format!("its format is {:?}, this program reads {}", head.format, READ.join(", "))));
    }
    if json::sha256(body) != head.sha256 {
        return Err(damaged("its content is not what its first line says: it was changed or cut off"));
    }
    let mut text = Vec::new();
    let decoder = zstd::Decoder::new(body).map_err(|e| damaged(&e.to_string()))?;
    std::io::Read::read_to_end(&mut std::io::Read::take(decoder, LARGEST_BYTES), &mut text)
        .map_err(|e| damaged(&e.to_string()))?;
    let tables: BTreeMap<String, Rows> = serde_json::from_slice(&text).map_err(|e| damaged(&e.to_string()))?;
    if let Some(unknown) = tables.keys().find(|name| !TABLES.iter().any(|(known, _)| known == name)) {
        return Err(damaged(&format!("it has rows of an unknown table {unknown:?}")));
    }
    if tables.get("studies").is_none_or(|rows| rows.len() != 1) {
        return Err(damaged("it does not hold one study"));
    }
    Ok(Archive(tables))
}

impl Archive {
    /// Identifier of the study.
    ///
    /// # Errors
    /// When it is none.
    pub fn study(&self) -> StoreResult<StudyId> {
        let id = self.0.get("studies").and_then(|rows| rows.first()?.get("id")?.as_str()?.parse().ok());
        id.ok_or_else(|| StoreError::Damaged { what: "archive", reason: "its study has no identifier".to_owned() })
    }
}

/// Writes every row of an archive, as it was. A study that was going on is paused; solves that ran are queued.
///
/// # Errors
/// A violated constraint, for one when the study is there already, or what the database reports.
pub async fn unpack(db: &mut Connection, archive: &Archive) -> StoreResult<()> {
    sqlx::query("pragma defer_foreign_keys = on").execute(&mut *db).await?;
    let mut same: HashMap<String, String> = HashMap::new();
    let mut sequence: HashMap<i64, i64> = HashMap::new();
    for (table, _) in TABLES {
        let columns = columns_of(db, table).await?;
        for row in archive.0.get(table).into_iter().flatten() {
            let mut row = row.clone();
            if matches!(table, "subjects" | "devices" | "reference_gaits")
                && is_there(db, table, &row, &mut same).await?
            {
                continue;
            }
            adapt(table, &mut row, &same, &sequence);
            if table == "studies" && !parent_is_there(db, &row).await? {
                row.insert("forked_from".to_owned(), Value::Null);
            }
            let before = if table == "feedback" { row.remove("seq").and_then(|seq| seq.as_i64()) } else { None };
            let written = insert(db, table, &columns, &row).await?;
            if let Some(before) = before {
                sequence.insert(before, written);
            }
        }
    }
    Ok(())
}

/// What must differ from the row as it was.
fn adapt(table: &str, row: &mut Map<String, Value>, same: &HashMap<String, String>, sequence: &HashMap<i64, i64>) {
    match table {
        "studies" => {
            for column in ["device_id", "reference_gait_id"] {
                let other = row.get(column).and_then(Value::as_str).and_then(|id| same.get(id)).cloned();
                if let Some(other) = other {
                    row.insert(column.to_owned(), other.into());
                }
            }
            if matches!(row.get("state").and_then(Value::as_str), Some("running" | "waiting")) {
                row.insert("state".to_owned(), "paused".into());
                row.insert("state_reason".to_owned(), "imported while it was going on".into());
            }
        }
        "jobs" if row.get("state").and_then(Value::as_str) == Some("leased") => {
            row.insert("state".to_owned(), "queued".into());
            row.insert("worker".to_owned(), Value::Null);
            row.insert("lease_until".to_owned(), Value::Null);
        }
        // Scripts keep what they asked for; what the program ran is queued again.
        "trials" => {
            let ours = row.get("asked_by").is_none_or(Value::is_null);
            if ours && row.get("state").and_then(Value::as_str) == Some("running") {
                row.insert("state".to_owned(), "queued".into());
            }
        }
        "retractions" => {
            let seq = row.get("feedback_seq").and_then(Value::as_i64).and_then(|seq| sequence.get(&seq));
            if let Some(seq) = seq {
                row.insert("feedback_seq".to_owned(), (*seq).into());
            }
        }
        "unblindings" => {
            row.remove("seq");
        }
        _ => {}
    }
}

/// Whether the very row is there, or a device or reference with the same content under another identifier.
async fn is_there(
    db: &mut Connection,
    table: &str,
    row: &Map<String, Value>,
    same: &mut HashMap<String, String>,
) -> StoreResult<bool> {
    let text = |name: &str| row.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
    let (id, hash) = (text("id"), text("sha256"));
    let content = if table == "subjects" { "id" } else { "sha256" };
    let sql = AssertSqlSafe(format!("select id from {table} where id = ? or {content} = ?"));
    let wanted = if table == "subjects" { &id } else { &hash };
    let found = sqlx::query(sql).bind(&id).bind(wanted).fetch_optional(db).await?;
    let Some(found) = found else { return Ok(false) };
    same.insert(id, found.try_get(0)?);
    Ok(true)
}

async fn parent_is_there(db: &mut Connection, row: &Map<String, Value>) -> StoreResult<bool> {
    let Some(parent) = row.get("forked_from").and_then(Value::as_str) else { return Ok(true) };
    Ok(sqlx::query("select 1 from studies where id = ?").bind(parent).fetch_optional(db).await?.is_some())
}

async fn columns_of(db: &mut Connection, table: &str) -> StoreResult<Vec<String>> {
    let rows = sqlx::query("select name from pragma_table_info(?)").bind(table).fetch_all(db).await?;
    rows.iter().map(|row| Ok(row.try_get(0)?)).collect()
}

/// Writes a row. Only names of columns that the table has are ever part of a statement.
async fn insert(db: &mut Connection, table: &str, known: &[String], row: &Map<String, Value>) -> StoreResult<i64> {
    if let Some(unknown) = row.keys().find(|name| !known.contains(name)) {
        let reason = format!("a row of {table} has an unknown column {unknown:?}");
        return Err(StoreError::Damaged { what: "archive", reason });
    }
    let names: Vec<&str> = row.keys().map(String::as_str).collect();
    let places = vec!["?"; names.len()].join(", ");
    let sql = AssertSqlSafe(format!("insert into {table} ({}) values ({places})", names.join(", ")));
    let mut query = sqlx::query(sql);
    for value in row.values() {
        query = match value {
            Value::Null => query.bind(None::<String>),
            Value::String(text) => query.bind(text.clone()),
            Value::Number(number) => match number.as_i64() {
                Some(integer) => query.bind(integer),
                None => query.bind(number.as_f64()),
            },
            Value::Object(object) => query.bind(bytes_of(object)?),
            Value::Bool(_) | Value::Array(_) => {
                let reason = format!("a row of {table} has a value that no column holds");
                return Err(StoreError::Damaged { what: "archive", reason });
            }
        };
    }
    Ok(query.execute(db).await?.last_insert_rowid())
}

fn to_json(row: &SqliteRow) -> StoreResult<Map<String, Value>> {
    let mut object = Map::new();
    for (index, column) in row.columns().iter().enumerate() {
        let raw = row.try_get_raw(index)?;
        let kind = raw.type_info().name().to_owned();
        let value = match kind.as_str() {
            _ if raw.is_null() => Value::Null,
            "INTEGER" | "BOOLEAN" => row.try_get::<i64, _>(index)?.into(),
            "REAL" => row.try_get::<f64, _>(index)?.into(),
            "BLOB" => json!({ "hexadecimal": hex::encode(row.try_get::<&[u8], _>(index)?) }),
            _ => row.try_get::<String, _>(index)?.into(),
        };
        object.insert(column.name().to_owned(), value);
    }
    Ok(object)
}

fn bytes_of(object: &Map<String, Value>) -> StoreResult<Vec<u8>> {
    let damaged = || StoreError::Damaged { what: "archive", reason: "a value is no hexadecimal text".to_owned() };
    let text = object.get("hexadecimal").and_then(Value::as_str).ok_or_else(damaged)?;
    hex::decode(text).map_err(|_| damaged())
}
