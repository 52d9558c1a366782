//! Rows of the access log: views and exports of subjects' data, and refusals.

use super::audit::Actor;
use super::{Connection, Instant, StoreResult, StudyId, SubjectId, json_columns, now};
use serde::{Deserialize, Serialize};
use serde_json::json;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use std::collections::HashMap;
use std::str::FromStr;
use utoipa::ToSchema;

/// Kind of access: `view`, data were shown; `export`, data were downloaded as a file; `refused`, the request was
/// refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = AccessKind)]
pub enum AccessKind {
    /// The data was shown.
    View,
    /// The data was exported as a file.
    Export,
    /// The request was refused: an invalid credential, a missing right, a failed sign-in, or an object that does not exist
    /// or that the caller may not access.
    Refused,
}

impl AccessKind {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::View => "view",
            Self::Export => "export",
            Self::Refused => "refused",
        }
    }
}

impl FromStr for AccessKind {
    type Err = super::StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::View, Self::Export, Self::Refused]
            .into_iter()
            .find(|kind| kind.as_str() == text)
            .ok_or_else(|| super::StoreError::unknown_value("kind of access", text))
    }
}

/// An access to log.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Access {
    /// Kind of the access.
    pub kind: AccessKind,
    /// Actor of the request.
    pub actor: String,
    /// Client address; empty for the command line.
    pub address: String,
    /// HTTP method; empty for the command line.
    pub method: String,
    /// Route, or command.
    pub route: String,
    /// Requested URL, without secrets.
    pub object: String,
    /// HTTP status; 0 for the command line.
    pub status: u16,
    /// Identifiers in the request, from which study and subject are found.
    pub named: Vec<String>,
}

/// Number and times of equal accesses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tally {
    /// First time.
    pub first_at: Instant,
    /// Last time.
    pub last_at: Instant,
    /// Number.
    pub times: u32,
}

/// Row of the access log.
#[derive(Debug, Clone, PartialEq)]
pub struct AccessRow {
    /// Sequence number.
    pub seq: i64,
    /// Time of the first access.
    pub created_at: Instant,
    /// Time of the last access.
    pub last_at: Instant,
    /// Number of identical accesses within a minute.
    pub times: u32,
    /// Kind of the access.
    pub kind: AccessKind,
    /// Actor of the request.
    pub actor: String,
    /// Client address; empty for the command line.
    pub address: String,
    /// HTTP method; empty for the command line.
    pub method: String,
    /// Route, or command.
    pub route: String,
    /// Requested URL, without secrets.
    pub object: String,
    /// HTTP status; 0 for the command line.
    pub status: u16,
    /// Study of the request, if any.
    pub study_id: Option<StudyId>,
    /// Subject of the request, if any.
    pub subject_id: Option<SubjectId>,
}

/// Appends rows.
///
/// # Errors
/// Errors of the database.
pub async fn append(db: &mut Connection, rows: &[(Access, Tally)]) -> StoreResult<()> {
    let mut known = HashMap::new();
    let mut values = Vec::new();
    for (access, tally) in rows {
        // One row for each subject; one without, if there is none.
        let mut subjects: Vec<(Option<StudyId>, Option<SubjectId>)> = Vec::new();
        for id in &access.named {
            let whose = match known.get(id.as_str()) {
                Some(whose) => *whose,
                None => whose_is(db, id).await?,
            };
            known.insert(id.as_str(), whose);
            if whose.1.is_some() && !subjects.iter().any(|(_, subject)| *subject == whose.1) {
                subjects.push(whose);
            }
        }
        if subjects.is_empty() {
            subjects.push((None, None));
        }
        values.extend(subjects.into_iter().map(|whose| {
            json!([
                tally.first_at,
                tally.last_at,
                tally.times,
                access.kind,
                access.actor,
                access.address,
                access.method,
                access.route,
                access.object,
                access.status,
                whose.0,
                whose.1,
            ])
        }));
    }
    sqlx::query(
        "insert into access_log (created_at, last_at, times, kind, actor, address, method, route, object, status, \
         study_id, subject_id) \
         select value ->> 0, value ->> 1, value ->> 2, value ->> 3, value ->> 4, value ->> 5, value ->> 6, value ->> 7, \
         value ->> 8, value ->> 9, value ->> 10, value ->> 11 from json_each(?) order by key",
    )
    .bind(json_columns::to_text("access log", &values)?)
    .execute(db)
    .await?;
    Ok(())
}

/// The study and the subject of an object of any kind.
async fn whose_is(db: &mut Connection, id: &str) -> StoreResult<(Option<StudyId>, Option<SubjectId>)> {
    let row = sqlx::query(
        "select id as study, subject_id as subject from studies where id = coalesce(\
         (select id from studies where id = ?1), (select study_id from trials where id = ?1), \
         (select study_id from lab_sessions where id = ?1), \
         (select l.study_id from measurement_files r join lab_sessions l on l.id = r.lab_session_id where r.id = ?1), \
         (select study_id from feedback where id = ?1), (select study_id from assessments where id = ?1), \
         (select study_id from blind_pairs where code = ?1)) \
         union all select null, id from subjects where id = ?1 limit 1",
    )
    .bind(id)
    .fetch_optional(db)
    .await?;
    let Some(row) = row else { return Ok((None, None)) };
    Ok((row.try_get("study")?, row.try_get("subject")?))
}

/// At most `limit` rows before `before`, newest first: those that contain a text, and those of a subject, if given.
///
/// # Errors
/// Errors of the database.
pub async fn page(
    db: &mut Connection,
    contains: &str,
    subject: Option<SubjectId>,
    before: Option<i64>,
    limit: u32,
) -> StoreResult<Vec<AccessRow>> {
    let rows = sqlx::query(
        "select * from access_log where (?1 is null or seq < ?1) and (?2 is null or subject_id = ?2)
             and (?3 = '' or instr(lower(kind || ' ' || actor || ' ' || address || ' ' || object || ' ' || coalesce(study_id, '')
                 || ' ' || coalesce((select pseudonym from subjects where id = subject_id), '')), lower(?3)) > 0)
         order by seq desc limit ?4",
    )
    .bind(before)
    .bind(subject)
    .bind(contains)
    .bind(limit)
    .fetch_all(db)
    .await?;
    rows.iter().map(from_row).collect()
}

/// Deletes at most `limit` rows that are older than `days` days, and returns their number.
///
/// # Errors
/// Errors of the database.
pub async fn prune(db: &mut Connection, actor: &Actor, days: u32, limit: u32) -> StoreResult<u64> {
    let before = now().plus_seconds(-86_400 * i64::from(days));
    // Rows are deleted from the beginning of the log, up to the first row that is young enough.
    let up_to: Option<i64> = sqlx::query_scalar(
        "select max(seq) from (select seq from access_log where seq < \
         coalesce((select min(seq) from access_log where last_at >= ?), 9223372036854775807) order by seq limit ?)",
    )
    .bind(before)
    .bind(limit)
    .fetch_one(&mut *db)
    .await?;
    let Some(up_to) = up_to else { return Ok(0) };
    sqlx::query("insert into access_prunings (up_to, older_than_days, actor, created_at) values (?, ?, ?, ?)")
        .bind(up_to)
        .bind(days)
        .bind(actor.as_str())
        .bind(now())
        .execute(&mut *db)
        .await?;
    Ok(sqlx::query("delete from access_log where seq <= ?").bind(up_to).execute(db).await?.rows_affected())
}

fn from_row(row: &SqliteRow) -> StoreResult<AccessRow> {
    Ok(AccessRow {
        seq: row.try_get("seq")?,
        created_at: row.try_get("created_at")?,
        last_at: row.try_get("last_at")?,
        times: row.try_get("times")?,
        kind: row.try_get::<&str, _>("kind")?.parse()?,
        actor: row.try_get("actor")?,
        address: row.try_get("address")?,
        method: row.try_get("method")?,
        route: row.try_get("route")?,
        object: row.try_get("object")?,
        status: row.try_get("status")?,
        study_id: row.try_get("study_id")?,
        subject_id: row.try_get("subject_id")?,
    })
}
