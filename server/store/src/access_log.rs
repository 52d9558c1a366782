//! The access log: who saw or exported data of subjects, and who was refused.

use super::audit::Actor;
use super::{Connection, Instant, StoreResult, StudyId, SubjectId, now};
use serde::{Deserialize, Serialize};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use std::str::FromStr;
use utoipa::ToSchema;

/// What was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Shown.
    View,
    /// Given out as a file.
    Export,
    /// Asked for and refused: a token or session that is not good, a right that is missing, a failed sign-in.
    Refused,
}

impl Kind {
    /// As stored and shown.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::View => "view",
            Self::Export => "export",
            Self::Refused => "refused",
        }
    }
}

impl FromStr for Kind {
    type Err = super::StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::View, Self::Export, Self::Refused]
            .into_iter()
            .find(|kind| kind.as_str() == text)
            .ok_or_else(|| super::StoreError::Damaged { what: "kind of access", reason: text.to_owned() })
    }
}

/// What a row says, before it is written.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Access {
    /// What was done.
    pub kind: Kind,
    /// By whom.
    pub actor: String,
    /// From which address; of the command line: empty.
    pub address: String,
    /// HTTP method; of the command line: empty.
    pub method: String,
    /// Route, or command.
    pub route: String,
    /// The address that was asked for, without secrets.
    pub object: String,
    /// HTTP status; of the command line: 0.
    pub status: u16,
    /// Identifiers that the request named: they lead to study and subject.
    pub named: Vec<String>,
}

/// How often and when.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tally {
    /// The first time.
    pub first_at: Instant,
    /// The last time.
    pub last_at: Instant,
    /// How often.
    pub times: u32,
}

/// A row of the log.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct AccessRow {
    /// Order.
    pub seq: i64,
    /// When, the first time.
    pub created_at: Instant,
    /// When, the last time.
    pub last_at: Instant,
    /// How often within a minute.
    pub times: u32,
    /// What was done.
    pub kind: Kind,
    /// By whom.
    pub actor: String,
    /// From which address; empty for the command line.
    pub address: String,
    /// HTTP method; empty for the command line.
    pub method: String,
    /// Route, or command.
    pub route: String,
    /// The address that was asked for, without secrets.
    pub object: String,
    /// HTTP status; 0 for the command line.
    pub status: u16,
    /// The study, where one was named.
    pub study_id: Option<StudyId>,
    /// The subject, where one was named.
    pub subject_id: Option<SubjectId>,
}

/// Appends a row.
///
/// # Errors
/// What the database reports.
pub async fn append(db: &mut Connection, access: &Access, tally: Tally) -> StoreResult<()> {
    let mut whose = (None, None);
    for id in &access.named {
        whose = whose_is(db, id).await?;
        if whose.1.is_some() {
            break;
        }
    }
    sqlx::query(
        "insert into access_log (created_at, last_at, times, kind, actor, address, method, route, object, status, \
         study_id, subject_id) values (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(tally.first_at)
    .bind(tally.last_at)
    .bind(tally.times)
    .bind(access.kind.as_str())
    .bind(&access.actor)
    .bind(&access.address)
    .bind(&access.method)
    .bind(&access.route)
    .bind(&access.object)
    .bind(access.status)
    .bind(whose.0)
    .bind(whose.1)
    .execute(db)
    .await?;
    Ok(())
}

/// Of which study and subject something is, whatever it is.
async fn whose_is(db: &mut Connection, id: &str) -> StoreResult<(Option<StudyId>, Option<SubjectId>)> {
    let row = sqlx::query(
        "select id as study, subject_id as subject from studies where id = coalesce(\
         (select id from studies where id = ?1), (select study_id from trials where id = ?1), \
         (select study_id from lab_sessions where id = ?1), \
         (select l.study_id from lab_recordings r join lab_sessions l on l.id = r.session_id where r.id = ?1), \
         (select study_id from feedback where id = ?1), (select study_id from remarks where id = ?1), \
         (select study_id from presentations where token = ?1)) \
         union all select null, id from subjects where id = ?1 limit 1",
    )
    .bind(id)
    .fetch_optional(db)
    .await?;
    let Some(row) = row else { return Ok((None, None)) };
    Ok((row.try_get("study")?, row.try_get("subject")?))
}

/// At most `limit` rows before `before`, newest first; those that `contains` stands in, where it is not empty, and those of
/// a subject, where one is named.
///
/// # Errors
/// What the database reports.
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

/// Takes away at most `limit` of the rows that are older than so many days: how many there were.
///
/// # Errors
/// What the database reports.
pub async fn prune(db: &mut Connection, actor: &Actor, days: u32, limit: u32) -> StoreResult<u64> {
    let before = now().plus_seconds(-86_400 * i64::from(days));
    // The log is pruned from its beginning on: what was written before the first row that is young enough.
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
