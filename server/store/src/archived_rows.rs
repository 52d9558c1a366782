//! The rows of a study in an archive: reads them from a record, and writes them to another one.

use super::archived_row::{Cell, Row};
use super::seals;
use super::{Connection, StoreError, StoreResult, StudyId, archived_allocations, consents, studies, time};
use futures_util::TryStreamExt;
use sqlx::{AssertSqlSafe, Row as _};
use std::collections::HashMap;
use tokio::sync::mpsc::Sender;

/// Tables in the order in which their rows can be written, with the condition for rows of a study. Certificates,
/// explanations and execution reports are not included: the importing service computes them again.
const TABLES: [(&str, &str); 31] = [
    ("subjects", "id in (select subject_id from studies where id = ?)"),
    ("devices", "id in (select device_id from studies where id = ?)"),
    ("reference_gaits", "id in (select reference_gait_id from studies where id = ?)"),
    ("studies", "id = ?"),
    ("study_restrictions", "study_id = ? order by seq"),
    ("trials", "study_id = ? order by number"),
    ("gaits", "trial_id in (select id from trials where study_id = ?)"),
    ("explanation_requests", "trial_id in (select id from trials where study_id = ?)"),
    ("solve_jobs", "trial_id in (select id from trials where study_id = ?)"),
    ("attempts", "trial_id in (select id from trials where study_id = ?)"),
    ("feedback", "study_id = ? order by seq"),
    ("feedback_retractions", "feedback_seq in (select seq from feedback where study_id = ?)"),
    ("blind_pairs", "study_id = ? order by id"),
    ("blind_pair_answers", "pair_id in (select id from blind_pairs where study_id = ?)"),
    ("blind_pair_retractions", "pair_id in (select id from blind_pairs where study_id = ?)"),
    ("blind_pair_allocations", archived_allocations::PAIRS),
    ("rater_unblindings", "study_id = ? order by seq"),
    ("assessments", "study_id = ? order by id"),
    ("assessment_retractions", "assessment_id in (select id from assessments where study_id = ?)"),
    ("safety_reports", "trial_id in (select id from trials where study_id = ?) order by rowid"),
    (
        "safety_reviews",
        "trial_id in (select id from trials where study_id = ?) \
         order by (select min(s.seq) from seals s where s.table_name = 'safety_reviews' and s.key = safety_reviews.id)",
    ),
    (
        "safety_review_reports",
        "review_id in (select r.id from safety_reviews r join trials t on t.id = r.trial_id where t.study_id = ?) \
         order by review_id, report_id",
    ),
    ("lab_sessions", "study_id = ? order by number"),
    ("lab_allocations", archived_allocations::LAB),
    ("controller_file_downloads", "lab_session_id in (select id from lab_sessions where study_id = ?) order by id"),
    ("lab_session_steps", "lab_session_id in (select id from lab_sessions where study_id = ?) order by rowid"),
    ("lab_answers", "lab_session_id in (select id from lab_sessions where study_id = ?) order by rowid"),
    ("lab_answer_retractions", "lab_session_id in (select id from lab_sessions where study_id = ?) order by rowid"),
    ("measurement_files", "lab_session_id in (select id from lab_sessions where study_id = ?) order by id"),
    ("emg_results", "lab_session_id in (select id from lab_sessions where study_id = ?) order by id"),
    ("imports", "study_id = ? order by seq"),
];

/// Alias of the column with the newest seal.
const SEAL: &str = "newest seal";

/// A row and its table.
#[derive(Debug)]
pub struct Read {
    /// Name of its table.
    pub table: &'static str,
    /// The row.
    pub row: Row,
    /// Whether rows of the table are sealed.
    pub sealed: bool,
    /// Hash of the row in its newest seal.
    pub seal: Option<String>,
}

/// The position and the name of a table in archives.
pub fn table(name: &str) -> Option<(usize, &'static str)> {
    TABLES.iter().map(|(table, _)| *table).enumerate().find(|(_, table)| *table == name)
}

/// Reads every row of a study in one consistent state, and sends it to `rows`. Ends early if the receiver is dropped.
///
/// # Errors
/// [`StoreError::Missing`], [`StoreError::Withdrawn`]; errors of the database.
pub async fn read(db: &mut Connection, study: StudyId, rows: &Sender<Read>) -> StoreResult<()> {
    let mut db = sqlx::Connection::begin(db).await?;
    studies::get(&mut db, study).await?;
    consents::may_be_shown(&mut db, study).await?;
    for (table, belongs) in TABLES {
        let newest = seals::newest_of(table);
        let seal = newest.as_deref().unwrap_or("null");
        let sql = AssertSqlSafe(format!("select {table}.*, {seal} as \"{SEAL}\" from {table} where {belongs}"));
        let mut found = sqlx::query(sql).bind(study).fetch(&mut *db);
        while let Some(row) = found.try_next().await? {
            let (seal, sealed) = (row.try_get(SEAL)?, newest.is_some());
            let row = Row::from_sqlite(&row, SEAL)?;
            if rows.send(Read { table, row, sealed, seal }).await.is_err() {
                return Ok(());
            }
        }
    }
    Ok(())
}

/// How a row of an archive relates to the record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RowMatch {
    /// The record does not have it.
    New,
    /// The record has an identical row with this identifier.
    Same(String),
    /// The record has a row with the same identifier, and these columns differ.
    Differs(Vec<String>),
    /// The record has another row with the same name.
    NameTaken(String),
}

/// Compares a subject, device or reference gait with the record.
///
/// # Errors
/// Errors of the database.
pub async fn known(db: &mut Connection, table: &str, row: &Row) -> StoreResult<RowMatch> {
    let id = row.text("id").unwrap_or_default();
    let sql = AssertSqlSafe(format!("select * from {table} where id = ?"));
    if let Some(found) = sqlx::query(sql).bind(id).fetch_optional(&mut *db).await? {
        let found = Row::from_sqlite(&found, SEAL)?;
        let differing: Vec<String> = found
            .cells()
            .filter(|(name, cell)| row.get(name).unwrap_or(&Cell::Null) != *cell)
            .map(|(name, _)| name.to_owned())
            .collect();
        return Ok(if differing.is_empty() { RowMatch::Same(id.to_owned()) } else { RowMatch::Differs(differing) });
    }
    if let Some(sha256) = row.text("sha256") {
        let sql = AssertSqlSafe(format!("select id from {table} where sha256 = ?"));
        if let Some(found) = sqlx::query_scalar(sql).bind(sha256).fetch_optional(&mut *db).await? {
            return Ok(RowMatch::Same(found));
        }
    }
    let name = match table {
        "subjects" => "pseudonym",
        "devices" => "name",
        _ => return Ok(RowMatch::New),
    };
    let taken = row.text(name).unwrap_or_default();
    let sql = AssertSqlSafe(format!("select 1 from {table} where lower(trim({name})) = lower(trim(?)) limit 1"));
    let found = sqlx::query(sql).bind(taken).fetch_optional(db).await?;
    Ok(if found.is_some() { RowMatch::NameTaken(taken.to_owned()) } else { RowMatch::New })
}

/// Writes the rows of one study into a record.
#[derive(Debug, Default)]
pub struct Unpacking {
    /// For subjects, devices and reference gaits that the record has under another identifier: that identifier.
    pub same: HashMap<String, String>,
    sequence: HashMap<i64, i64>,
    columns: HashMap<&'static str, Vec<String>>,
}

impl Unpacking {
    /// Writes a row unchanged.
    ///
    /// # Errors
    /// A violated constraint or trigger, an unknown column; errors of the database.
    pub async fn write(&mut self, db: &mut Connection, table: &'static str, row: Row) -> StoreResult<i64> {
        if !self.columns.contains_key(table) {
            let rows = sqlx::query_scalar("select name from pragma_table_info(?)").bind(table).fetch_all(&mut *db);
            self.columns.insert(table, rows.await?);
        }
        row.insert(db, table, self.columns.get(table).map_or(&[], Vec::as_slice)).await
    }

    /// Writes a row with the necessary changes: a running study is paused, running solves are queued, and rows get
    /// sequence numbers of this record. Later rows get later times.
    ///
    /// # Errors
    /// A violated constraint or trigger; errors of the database.
    pub async fn adapt_and_write(&mut self, db: &mut Connection, table: &'static str, mut row: Row) -> StoreResult<()> {
        let text = |value: &str| Cell::Text(value.to_owned());
        for (column, cell) in row.cells() {
            if let (true, Cell::Text(at)) = (column.ends_with("_at"), cell)
                && let Ok(at) = at.parse()
            {
                time::never_before(at);
            }
        }
        let mut before = None;
        match table {
            "studies" => {
                for column in ["subject_id", "device_id", "reference_gait_id"] {
                    if let Some(other) = row.text(column).and_then(|id| self.same.get(id)).cloned() {
                        row.set(column, Cell::Text(other));
                    }
                }
                if matches!(row.text("state"), Some("running" | "waiting")) {
                    row.set("state", text("paused"));
                    row.set("state_reason", text("The study was running when it was exported."));
                }
                if let Some(parent) = row.text("cloned_from") {
                    let found = sqlx::query("select 1 from studies where id = ?").bind(parent.to_owned());
                    if found.fetch_optional(&mut *db).await?.is_none() {
                        row.set("cloned_from", Cell::Null);
                    }
                }
            }
            "solve_jobs" if row.text("state") == Some("leased") => {
                row.set("state", text("queued"));
                row.set("worker", Cell::Null);
                row.set("lease_until", Cell::Null);
            }
            // Scripts keep their open trials. Our own running solves are queued again.
            "trials" if row.text("script").is_none() && row.text("state") == Some("running") => {
                row.set("state", text("queued"));
            }
            "feedback" => {
                before = row.integer("seq");
                row.remove("seq");
            }
            "feedback_retractions" => {
                if let Some(seq) = row.integer("feedback_seq").and_then(|seq| self.sequence.get(&seq)) {
                    row.set("feedback_seq", Cell::Integer(*seq));
                }
            }
            "rater_unblindings" | "imports" | "study_restrictions" => {
                row.remove("seq");
            }
            _ => {}
        }
        let written = self.write(db, table, row).await?;
        if let Some(before) = before {
            self.sequence.insert(before, written);
        }
        Ok(())
    }
}

/// The first trial whose state contradicts its job: queued or running without an open job, or ended with one.
///
/// # Errors
/// Errors of the database.
pub async fn trial_unlike_its_solve_job(db: &mut Connection) -> StoreResult<Option<u32>> {
    Ok(sqlx::query_scalar(
        "select t.number from trials t left join solve_jobs j on j.trial_id = t.id \
         where (t.script is null and t.state in ('queued', 'running')) <> coalesce(j.state <> 'done', 0) \
         order by t.number limit 1",
    )
    .fetch_optional(db)
    .await?)
}

/// Reads the only definition of a table, for checks against its name and hash.
///
/// # Errors
/// Errors of the database.
pub async fn definition(db: &mut Connection, table: &str) -> StoreResult<Definition> {
    let sql = AssertSqlSafe(format!("select name, definition, sha256 from {table}"));
    let rows = sqlx::query(sql).fetch_all(db).await?;
    let [row] = &rows[..] else {
        let reason = format!("{table} has {} rows instead of one", rows.len());
        return Err(StoreError::Damaged { what: "archive", reason });
    };
    Ok(Definition { name: row.try_get("name")?, text: row.try_get("definition")?, sha256: row.try_get("sha256")? })
}

/// A device or reference gait in an archive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Definition {
    /// Its name.
    pub name: String,
    /// The JSON text.
    pub text: String,
    /// The stored hash.
    pub sha256: String,
}
