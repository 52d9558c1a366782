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
    /// Identifier of the trial.
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

// A cross join keeps this order: there are few reports, and a study may have ten thousand trials.
const OF_STUDY: &str =
    "select r.* from safety_reports r cross join trials t on t.id = r.trial_id where t.study_id = ? order by r.rowid";

/// The reports of a study, in the order of recording.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<SafetyReport>> {
    let rows = sqlx::query(OF_STUDY).bind(study).fetch_all(db).await?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema_versions;
    use sqlx::{AssertSqlSafe, Connection as _, SqliteConnection};

    /// A preference asks this while it holds the only writer.
    #[tokio::test]
    async fn reports_of_a_study_are_found_without_reading_its_trials() {
        let mut db = SqliteConnection::connect(":memory:").await.unwrap();
        schema_versions::fresh(&mut db).await.unwrap();
        let plan = AssertSqlSafe(format!("explain query plan {OF_STUDY}"));
        let steps = sqlx::query(plan).bind("s").fetch_all(&mut db).await.unwrap();
        let steps: Vec<String> = steps.iter().map(|step| step.get("detail")).collect();
        assert!(steps[0] == "SCAN r" && steps[1].starts_with("SEARCH t") && steps[1].contains("(id=?)"), "{steps:?}");
    }
}
