//! Assessments: what staff say of two gaits that is no preference.

use super::feedback::{Attribution, Retraction, Source};
use super::presentations::Judgement;
use super::{AssessmentId, Connection, FeedbackId, Instant, StoreError, StoreResult, StudyId, TrialId, now};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// A recorded assessment.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// Identifier.
    pub id: AssessmentId,
    /// The study.
    pub study_id: StudyId,
    /// The trial with the first of the two gaits.
    pub first: TrialId,
    /// The trial with the second of the two gaits.
    pub second: TrialId,
    /// `cannot_tell`, `unsafe_first`, `unsafe_second` or `unsafe_both`.
    pub answer: Judgement,
    /// Who answered.
    pub source: Source,
    /// Author.
    pub author: String,
    /// Free text.
    pub note: String,
    /// Preference that was derived from it, if any.
    pub feedback_id: Option<FeedbackId>,
    /// Time of recording.
    pub created_at: Instant,
    /// Retraction, if it was retracted.
    pub retraction: Option<Retraction>,
}

impl Assessment {
    /// The two gaits.
    pub fn pair(&self) -> (TrialId, TrialId) {
        (self.first, self.second)
    }
}

/// An assessment to write.
#[derive(Debug, Clone, Copy)]
pub struct NewAssessment<'a> {
    /// The study.
    pub study: StudyId,
    /// The two gaits.
    pub pair: (TrialId, TrialId),
    /// The judgement.
    pub judgement: Judgement,
    /// Source, author and note.
    pub attribution: Attribution<'a>,
    /// The derived preference, if any.
    pub feedback: Option<FeedbackId>,
}

/// Adds an assessment.
///
/// # Errors
/// A violated constraint or trigger, or errors of the database.
pub async fn insert(db: &mut Connection, new: &NewAssessment<'_>) -> StoreResult<AssessmentId> {
    let id = AssessmentId::fresh();
    sqlx::query(
        "insert into assessments (id, study_id, first, second, answer, source, author, note, feedback_id, created_at) \
         values (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(id)
    .bind(new.study)
    .bind(new.pair.0)
    .bind(new.pair.1)
    .bind(new.judgement.as_str())
    .bind(new.attribution.source.as_str())
    .bind(new.attribution.author)
    .bind(new.attribution.note)
    .bind(new.feedback)
    .bind(now())
    .execute(db)
    .await?;
    Ok(id)
}

/// Retracts an assessment. Returns `false` if it was already retracted.
///
/// # Errors
/// Errors of the database.
pub async fn retract(db: &mut Connection, id: AssessmentId, author: &str, reason: &str) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into assessment_retractions (assessment_id, author, reason, created_at) values (?, ?, ?, ?) \
         on conflict (assessment_id) do nothing",
    )
    .bind(id)
    .bind(author)
    .bind(reason)
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() == 1)
}

const SELECT: &str = "select m.*, r.author as retracted_by, r.reason as retracted_because, \
                      r.created_at as retracted_at from assessments m \
                      left join assessment_retractions r on r.assessment_id = m.id ";

/// The assessment with this identifier.
///
/// # Errors
/// [`StoreError::Missing`], or errors of the database.
pub async fn get(db: &mut Connection, id: AssessmentId) -> StoreResult<Assessment> {
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} where m.id = ?"));
    let row = sqlx::query(sql).bind(id).fetch_optional(db).await?;
    let missing = || StoreError::Missing { what: "assessment", id: id.to_string() };
    row.as_ref().map(from_row).transpose()?.ok_or_else(missing)
}

/// Every assessment of a study, by time, including retracted ones.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<Assessment>> {
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} where m.study_id = ? order by m.id"));
    let rows = sqlx::query(sql).bind(study).fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

fn from_row(row: &SqliteRow) -> StoreResult<Assessment> {
    Ok(Assessment {
        id: row.try_get("id")?,
        study_id: row.try_get("study_id")?,
        first: row.try_get("first")?,
        second: row.try_get("second")?,
        answer: row.try_get::<&str, _>("answer")?.parse()?,
        source: row.try_get::<&str, _>("source")?.parse()?,
        author: row.try_get("author")?,
        note: row.try_get("note")?,
        feedback_id: row.try_get("feedback_id")?,
        created_at: row.try_get("created_at")?,
        retraction: Retraction::from_row(row)?,
    })
}
