//! Assessments: answers of staff about two gaits that state no preference.

use super::blind_pairs::OrderedAnswer;
use super::feedback::{Attribution, Origin, Retraction, Source};
use super::{AnswerId, AssessmentId, Connection, FeedbackId, Instant, StoreError, StoreResult, StudyId, TrialId, now};
use serde::{Deserialize, Serialize};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use utoipa::ToSchema;

/// Statement of a person instead of a preference between two gaits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum AssessmentAnswer {
    /// The person cannot tell which gait is better.
    CannotTell,
    /// Gait A must not be used for walking.
    UnsafeA,
    /// Gait B must not be used for walking.
    UnsafeB,
    /// Neither gait may be used for walking.
    UnsafeBoth,
}

impl AssessmentAnswer {
    /// Whether it is a safety report.
    pub fn is_about_safety(self) -> bool {
        self != Self::CannotTell
    }
}

impl From<AssessmentAnswer> for OrderedAnswer {
    /// The answer if gait A is the first one.
    fn from(answer: AssessmentAnswer) -> Self {
        match answer {
            AssessmentAnswer::CannotTell => Self::CannotTell,
            AssessmentAnswer::UnsafeA => Self::UnsafeFirst,
            AssessmentAnswer::UnsafeB => Self::UnsafeSecond,
            AssessmentAnswer::UnsafeBoth => Self::UnsafeBoth,
        }
    }
}

impl TryFrom<OrderedAnswer> for AssessmentAnswer {
    type Error = StoreError;

    /// The answer if gait A is the first one.
    fn try_from(answer: OrderedAnswer) -> StoreResult<Self> {
        match answer {
            OrderedAnswer::CannotTell => Ok(Self::CannotTell),
            OrderedAnswer::UnsafeFirst => Ok(Self::UnsafeA),
            OrderedAnswer::UnsafeSecond => Ok(Self::UnsafeB),
            OrderedAnswer::UnsafeBoth => Ok(Self::UnsafeBoth),
            OrderedAnswer::First | OrderedAnswer::Second | OrderedAnswer::NoDifference | OrderedAnswer::Retracted => {
                Err(StoreError::unknown_value("assessment answer", answer.as_str()))
            }
        }
    }
}

/// A recorded assessment.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// Identifier.
    pub id: AssessmentId,
    /// Identifier of the study.
    pub study_id: StudyId,
    /// The trial with gait A.
    pub trial_a: TrialId,
    /// The trial with gait B.
    pub trial_b: TrialId,
    /// The answer.
    pub answer: AssessmentAnswer,
    /// Source of the answer.
    pub source: Source,
    /// Name or pseudonym of the person who answered.
    pub author: String,
    /// Free text.
    pub note: String,
    /// Preference that was derived from it, if any.
    pub feedback_id: Option<FeedbackId>,
    /// The answer in whose place it was given.
    pub replaces: Option<AnswerId>,
    /// The assessment that it brings back, because the change to another answer was undone.
    pub restores: Option<AssessmentId>,
    /// Time of recording.
    pub created_at: Instant,
    /// Retraction, if it was retracted.
    pub retraction: Option<Retraction>,
}

impl Assessment {
    /// The two gaits.
    pub fn pair(&self) -> (TrialId, TrialId) {
        (self.trial_a, self.trial_b)
    }
}

/// An assessment to write.
#[derive(Debug, Clone, Copy)]
pub struct UnsavedAssessment<'a> {
    /// The study.
    pub study: StudyId,
    /// The two gaits.
    pub pair: (TrialId, TrialId),
    /// The answer.
    pub answer: AssessmentAnswer,
    /// Source, author and note.
    pub attribution: Attribution<'a>,
    /// The derived preference, if any.
    pub feedback: Option<FeedbackId>,
    /// How it relates to an earlier answer.
    pub origin: Origin<AssessmentId>,
}

/// Adds an assessment.
///
/// # Errors
/// A violated constraint or trigger, or errors of the database.
pub async fn insert(db: &mut Connection, new: &UnsavedAssessment<'_>) -> StoreResult<AssessmentId> {
    let id = AssessmentId::fresh();
    sqlx::query(
        "insert into assessments (id, study_id, trial_a, trial_b, answer, source, author, note, feedback_id, \
         replaces, restores, created_at) values (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(id)
    .bind(new.study)
    .bind(new.pair.0)
    .bind(new.pair.1)
    .bind(OrderedAnswer::from(new.answer).about_gaits())
    .bind(new.attribution.source.as_str())
    .bind(new.attribution.author)
    .bind(new.attribution.note)
    .bind(new.feedback)
    .bind(new.origin.replaces())
    .bind(new.origin.restores())
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

/// The assessment with this identifier, if there is one.
///
/// # Errors
/// Errors of the database.
pub async fn find(db: &mut Connection, id: AssessmentId) -> StoreResult<Option<Assessment>> {
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} where m.id = ?"));
    let row = sqlx::query(sql).bind(id).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()
}

/// The assessment with this identifier.
///
/// # Errors
/// [`StoreError::Missing`], or errors of the database.
pub async fn get(db: &mut Connection, id: AssessmentId) -> StoreResult<Assessment> {
    find(db, id).await?.ok_or_else(|| StoreError::Missing { what: "assessment", id: id.to_string() })
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

/// The assessment that brings another one back.
///
/// # Errors
/// Errors of the database.
pub async fn restoration(db: &mut Connection, id: AssessmentId) -> StoreResult<Option<AssessmentId>> {
    Ok(sqlx::query_scalar("select id from assessments where restores = ?").bind(id).fetch_optional(db).await?)
}

/// Whether a preference was derived from an assessment.
///
/// # Errors
/// Errors of the database.
pub async fn is_derived(db: &mut Connection, preference: FeedbackId) -> StoreResult<bool> {
    let study = "select study_id from feedback where id = ?1";
    let sql = format!("select exists (select 1 from assessments where feedback_id = ?1 and study_id = ({study}))");
    Ok(sqlx::query_scalar(sqlx::AssertSqlSafe(sql)).bind(preference).fetch_one(db).await?)
}

fn from_row(row: &SqliteRow) -> StoreResult<Assessment> {
    Ok(Assessment {
        id: row.try_get("id")?,
        study_id: row.try_get("study_id")?,
        trial_a: row.try_get("trial_a")?,
        trial_b: row.try_get("trial_b")?,
        answer: OrderedAnswer::from_gaits(row.try_get("answer")?)?.try_into()?,
        source: row.try_get::<&str, _>("source")?.parse()?,
        author: row.try_get("author")?,
        note: row.try_get("note")?,
        feedback_id: row.try_get("feedback_id")?,
        replaces: row.try_get("replaces")?,
        restores: row.try_get("restores")?,
        created_at: row.try_get("created_at")?,
        retraction: Retraction::from_row(row)?,
    })
}
