//! Stored safety reviews: decisions of staff about safety reports.

use super::{Connection, Instant, SafetyReportId, SafetyReviewId, StoreError, StoreResult, StudyId, TrialId, now};
use serde::{Deserialize, Serialize};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use std::str::FromStr;
use utoipa::ToSchema;

/// Decision of a safety review: `cleared`, the gait may be used for walking; `unsafe`, it remains marked as unsafe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SafetyDecision {
    /// The gait is cleared for walking.
    Cleared,
    /// The gait remains marked as unsafe.
    Unsafe,
}

impl SafetyDecision {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Cleared => "cleared",
            Self::Unsafe => "unsafe",
        }
    }
}

impl FromStr for SafetyDecision {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::Cleared, Self::Unsafe]
            .into_iter()
            .find(|decision| decision.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("decision of a safety review", text))
    }
}

/// A decision about the safety reports of a gait.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SafetyReview {
    /// Identifier.
    pub id: SafetyReviewId,
    /// Trial of the reviewed gait.
    pub trial_id: TrialId,
    /// The reports that the review covers. Another report about the same gait needs another review.
    pub reports: Vec<SafetyReportId>,
    /// Decision about the reports.
    pub decision: SafetyDecision,
    /// Name or pseudonym of the reviewer.
    pub author: String,
    /// Reason for the decision.
    pub reason: String,
    /// Time of the review.
    pub created_at: Instant,
}

/// A review to add.
#[derive(Debug, Clone, Copy)]
pub struct NewSafetyReview<'a> {
    /// Trial of the reviewed gait.
    pub trial: TrialId,
    /// The reports that the review covers.
    pub reports: &'a [SafetyReportId],
    /// Decision.
    pub decision: SafetyDecision,
    /// Reviewer.
    pub author: &'a str,
    /// Reason.
    pub reason: &'a str,
}

const SELECT: &str = "select r.*, (select group_concat(report_id) from safety_review_reports where review_id = r.id) as reports \
                      from safety_reviews r";

/// Adds a review.
///
/// # Errors
/// A violated constraint or trigger; errors of the database.
pub async fn insert(db: &mut Connection, new: NewSafetyReview<'_>) -> StoreResult<SafetyReviewId> {
    let id = SafetyReviewId::fresh();
    sqlx::query(
        "insert into safety_reviews (id, trial_id, decision, author, reason, created_at) \
         values (?, ?, ?, ?, ?, ?)",
    )
    .bind(id)
    .bind(new.trial)
    .bind(new.decision.as_str())
    .bind(new.author)
    .bind(new.reason)
    .bind(now())
    .execute(&mut *db)
    .await?;
    for report in new.reports {
        sqlx::query("insert into safety_review_reports (review_id, report_id) values (?, ?)")
            .bind(id)
            .bind(report)
            .execute(&mut *db)
            .await?;
    }
    Ok(id)
}

/// The review with this identifier.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn get(db: &mut Connection, id: SafetyReviewId) -> StoreResult<SafetyReview> {
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} where r.id = ?"));
    let row = sqlx::query(sql).bind(id).fetch_optional(db).await?;
    let missing = || StoreError::Missing { what: "safety review", id: id.to_string() };
    row.as_ref().map(from_row).transpose()?.ok_or_else(missing)
}

/// Every review of a study, in the order of recording.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<SafetyReview>> {
    // In the order of their seals, which nobody can change unnoticed. A review of the present change has none yet.
    let of_study = "cross join trials t on t.id = r.trial_id where t.study_id = ? order by \
                    ifnull((select min(s.seq) from seals s where s.table_name = 'safety_reviews' and s.key = r.id), 1e18), \
                    r.rowid";
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} {of_study}"));
    let rows = sqlx::query(sql).bind(study).fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

fn from_row(row: &SqliteRow) -> StoreResult<SafetyReview> {
    let reports = row.try_get::<Option<&str>, _>("reports")?.unwrap_or_default();
    let reports = reports.split_terminator(',').map(str::parse).collect::<Result<_, _>>();
    let damaged = |e: uuid::Error| StoreError::Damaged { what: "report of a safety review", reason: e.to_string() };
    Ok(SafetyReview {
        id: row.try_get("id")?,
        trial_id: row.try_get("trial_id")?,
        reports: reports.map_err(damaged)?,
        decision: row.try_get::<&str, _>("decision")?.parse()?,
        author: row.try_get("author")?,
        reason: row.try_get("reason")?,
        created_at: row.try_get("created_at")?,
    })
}

/// The numbers of reports, assessments, answers, retractions, unblindings and reviews of all studies of a subject. These
/// tables are append-only, so equal versions mean that no safety report or review came in between.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SafetyVersion([i64; 9]);

/// The current version for a study.
///
/// # Errors
/// Errors of the database.
pub async fn version(db: &mut Connection, study: StudyId) -> StoreResult<SafetyVersion> {
    let row = sqlx::query(
        "with own as (select id from studies where subject_id = (select subject_id from studies where id = ?1))
         select (select count(*) from blind_pair_answers a join blind_pairs p on p.id = a.pair_id
                 where p.study_id in own),
                (select count(*) from blind_pair_retractions r join blind_pairs p on p.id = r.pair_id
                 where p.study_id in own),
                (select count(*) from assessments where study_id in own),
                (select count(*) from assessment_retractions r join assessments m on m.id = r.assessment_id
                 where m.study_id in own),
                (select count(*) from lab_answers a join lab_sessions s on s.id = a.lab_session_id
                 where s.study_id in own),
                (select count(*) from lab_answer_retractions r join lab_sessions s on s.id = r.lab_session_id
                 where s.study_id in own),
                (select count(*) from lab_session_steps a join lab_sessions s on s.id = a.lab_session_id
                 where s.study_id in own and a.step = 'unblinded'),
                (select count(*) from safety_reviews r cross join trials t on t.id = r.trial_id
                 where t.study_id in own),
                (select count(*) from safety_reports r cross join trials t on t.id = r.trial_id
                 where t.study_id in own)",
    )
    .bind(study)
    .fetch_one(db)
    .await?;
    let mut counts = [0; 9];
    for (place, count) in counts.iter_mut().enumerate() {
        *count = row.try_get(place)?;
    }
    Ok(SafetyVersion(counts))
}
