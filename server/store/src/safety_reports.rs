//! Stored reports that one gait is unsafe. Those that belong to a comparison are answers and assessments.

use super::feedback::{Attribution, Source};
use super::{Connection, Instant, SafetyReportId, StoreResult, StudyId, TrialId, now};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// A report on record.
#[derive(Debug, Clone, PartialEq)]
pub struct SafetyReport {
    /// Identifier.
    pub id: SafetyReportId,
    /// The trial.
    pub trial_id: TrialId,
    /// Kind of the author.
    pub source: Source,
    /// Author.
    pub author: String,
    /// Free text.
    pub note: String,
    /// Time of the report.
    pub created_at: Instant,
}

/// Adds a report.
///
/// # Errors
/// A violated constraint or trigger, or errors of the database.
pub async fn insert(db: &mut Connection, trial: TrialId, attribution: Attribution<'_>) -> StoreResult<SafetyReportId> {
    let id = SafetyReportId::fresh();
    sqlx::query(
        "insert into safety_reports (id, trial_id, source, author, note, created_at) values (?, ?, ?, ?, ?, ?)",
    )
    .bind(id)
    .bind(trial)
    .bind(attribution.source.as_str())
    .bind(attribution.author)
    .bind(attribution.note)
    .bind(now())
    .execute(db)
    .await?;
    Ok(id)
}

/// The reports of a study, in the order of recording.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<SafetyReport>> {
    let sql =
        "select r.* from safety_reports r join trials t on t.id = r.trial_id where t.study_id = ? order by r.rowid";
    let rows = sqlx::query(sql).bind(study).fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

fn from_row(row: &SqliteRow) -> StoreResult<SafetyReport> {
    Ok(SafetyReport {
        id: row.try_get("id")?,
        trial_id: row.try_get("trial_id")?,
        source: row.try_get::<&str, _>("source")?.parse()?,
        author: row.try_get("author")?,
        note: row.try_get("note")?,
        created_at: row.try_get("created_at")?,
    })
}
