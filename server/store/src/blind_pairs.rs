//! Stored blind pairs: the pairs shown to raters, and their answers.
//!
//! The sides are an allocation (`super::allocations`). Rows and answers here refer to the pair, with the newer gait
//! first.

use super::{BlindPairId, Connection, FeedbackId, Instant, StoreError, StoreResult, StudyId, TrialId, feedback, now};
use serde::{Deserialize, Serialize};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use std::str::FromStr;
use utoipa::ToSchema;

/// Why a pair is shown: `new`, the pending comparison; `repeat`, an earlier pair again, to measure agreement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BlindPairKind {
    /// The pending comparison of the study.
    New,
    /// Repetition of an earlier pair, to measure the agreement of the rater.
    Repeat,
}

impl BlindPairKind {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::New => "new",
            Self::Repeat => "repeat",
        }
    }
}

impl FromStr for BlindPairKind {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::New, Self::Repeat]
            .into_iter()
            .find(|kind| kind.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("kind of a blind pair", text))
    }
}

/// Answer about two gaits in the order in which they were shown or walked: which one is better, no difference, cannot
/// tell, or which one is unsafe. `retracted` is reserved for the service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OrderedAnswer {
    /// The gait shown first is better.
    First,
    /// The gait shown second is better.
    Second,
    /// There is no difference.
    NoDifference,
    /// The person cannot tell.
    CannotTell,
    /// The first gait must not be used for walking.
    UnsafeFirst,
    /// The second gait must not be used for walking.
    UnsafeSecond,
    /// Neither gait may be used for walking.
    UnsafeBoth,
    /// Retracted by the service, because a gait was reported as unsafe in the meantime, or retracted by its author.
    Retracted,
}

impl OrderedAnswer {
    /// Every answer.
    pub const ALL: [Self; 8] = [
        Self::First,
        Self::Second,
        Self::NoDifference,
        Self::CannotTell,
        Self::UnsafeFirst,
        Self::UnsafeSecond,
        Self::UnsafeBoth,
        Self::Retracted,
    ];

    /// The entry for the learner, if any. An unsafe gait loses against the other one.
    pub fn feedback(self, (first, second): (TrialId, TrialId)) -> Option<feedback::FeedbackContent> {
        match self {
            Self::First | Self::UnsafeSecond => {
                Some(feedback::FeedbackContent::Preference { winner: first, loser: second })
            }
            Self::Second | Self::UnsafeFirst => {
                Some(feedback::FeedbackContent::Preference { winner: second, loser: first })
            }
            Self::NoDifference => Some(feedback::FeedbackContent::NoDifference { a: first, b: second }),
            Self::CannotTell | Self::UnsafeBoth | Self::Retracted => None,
        }
    }

    /// The answer with the two gaits exchanged.
    #[must_use]
    pub fn swapped(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
            Self::UnsafeFirst => Self::UnsafeSecond,
            Self::UnsafeSecond => Self::UnsafeFirst,
            Self::NoDifference | Self::CannotTell | Self::UnsafeBoth | Self::Retracted => self,
        }
    }

    /// Whether it is a safety report.
    pub fn is_about_safety(self) -> bool {
        matches!(self, Self::UnsafeFirst | Self::UnsafeSecond | Self::UnsafeBoth)
    }

    /// Whether it is an assessment: an answer by a person that states no preference.
    pub fn is_assessment(self) -> bool {
        self == Self::CannotTell || self.is_about_safety()
    }

    /// The gaits that must not be used for walking.
    pub fn unsafe_of(self, (first, second): (TrialId, TrialId)) -> Vec<TrialId> {
        match self {
            Self::UnsafeFirst => vec![first],
            Self::UnsafeSecond => vec![second],
            Self::UnsafeBoth => vec![first, second],
            _ => Vec::new(),
        }
    }

    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::Second => "second",
            Self::NoDifference => "no_difference",
            Self::CannotTell => "cannot_tell",
            Self::UnsafeFirst => "unsafe_first",
            Self::UnsafeSecond => "unsafe_second",
            Self::UnsafeBoth => "unsafe_both",
            Self::Retracted => "retracted",
        }
    }

    /// The name in the record of an answer about gait A and gait B, if gait A is the first one.
    pub(super) fn about_gaits(self) -> &'static str {
        match self {
            Self::First => "a",
            Self::Second => "b",
            Self::UnsafeFirst => "unsafe_a",
            Self::UnsafeSecond => "unsafe_b",
            Self::NoDifference | Self::CannotTell | Self::UnsafeBoth | Self::Retracted => self.as_str(),
        }
    }

    /// Reads [`about_gaits`](Self::about_gaits).
    pub(super) fn from_gaits(text: &str) -> StoreResult<Self> {
        Self::ALL
            .into_iter()
            .find(|answer| answer.about_gaits() == text)
            .ok_or_else(|| StoreError::unknown_value("answer about two gaits", text))
    }
}

impl FromStr for OrderedAnswer {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        Self::ALL
            .into_iter()
            .find(|answer| answer.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("answer in a lab session", text))
    }
}

/// A pair shown to a rater, without its sides.
#[derive(Debug, Clone, PartialEq)]
pub struct BlindPair {
    /// Identifier.
    pub id: BlindPairId,
    /// Token by which the rater knows the pair.
    pub code: String,
    /// Identifier of the study.
    pub study_id: StudyId,
    /// Name of the rater.
    pub rater: String,
    /// Number for this rater in this study, from 1.
    pub number: u32,
    /// Why it was shown.
    pub kind: BlindPairKind,
    /// Gait A, which is the newer one, independent of its side.
    pub trial_a: TrialId,
    /// Gait B.
    pub trial_b: TrialId,
    /// The earlier pair that it repeats.
    pub repeats: Option<BlindPairId>,
    /// Whether the rater could have known the allocation.
    pub could_have_known: bool,
    /// Time at which the pair was drawn.
    pub created_at: Instant,
    /// The answer about the pair, where `First` is gait A; `None` if there is none yet.
    pub answer: Option<OrderedAnswer>,
    /// Time of the answer.
    pub answered_at: Option<Instant>,
    /// Free text of the answer; empty without one.
    pub note: String,
}

impl BlindPair {
    /// The two gaits, in an order that does not reveal the sides.
    pub fn trials(&self) -> (TrialId, TrialId) {
        (self.trial_a, self.trial_b)
    }

    /// Whether one of the two gaits is among these trials.
    pub fn has_one_of(&self, trials: &[TrialId]) -> bool {
        trials.contains(&self.trial_a) || trials.contains(&self.trial_b)
    }
}

/// A pair to add.
#[derive(Debug, Clone)]
pub struct NewBlindPair {
    /// Token by which the rater knows the pair.
    pub code: String,
    /// Identifier of the study.
    pub study_id: StudyId,
    /// Name of the rater.
    pub rater: String,
    /// Number for this rater in this study, from 1.
    pub number: u32,
    /// Why it is shown.
    pub kind: BlindPairKind,
    /// The two gaits, the newer one first.
    pub pair: (TrialId, TrialId),
    /// The earlier pair that it repeats.
    pub repeats: Option<BlindPairId>,
    /// Whether the rater could have known the allocation.
    pub could_have_known: bool,
}

/// Adds a pair.
///
/// # Errors
/// A violated constraint; errors of the database.
pub async fn insert(db: &mut Connection, new: &NewBlindPair) -> StoreResult<BlindPairId> {
    let id = BlindPairId::fresh();
    sqlx::query(
        "insert into blind_pairs (id, code, study_id, rater, number, kind, trial_a, trial_b, repeats, \
         unblinded, created_at) values (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(id)
    .bind(&new.code)
    .bind(new.study_id)
    .bind(&new.rater)
    .bind(new.number)
    .bind(new.kind.as_str())
    .bind(new.pair.0)
    .bind(new.pair.1)
    .bind(new.repeats)
    .bind(new.could_have_known)
    .bind(now())
    .execute(db)
    .await?;
    Ok(id)
}

/// An answer to record.
#[derive(Debug, Clone, Copy)]
pub struct NewPairAnswer<'a> {
    /// The answer of the pair.
    pub answer: OrderedAnswer,
    /// Response time by the rater's clock, ms.
    pub response_ms: Option<i64>,
    /// Free text.
    pub note: &'a str,
    /// The derived entry of the feedback log.
    pub feedback: Option<FeedbackId>,
    /// Whether the rater could have known the allocation.
    pub could_have_known: bool,
}

/// Records the answer about a pair. Returns `false` if it has one already.
///
/// # Errors
/// Errors of the database.
pub async fn answer(db: &mut Connection, id: BlindPairId, new: NewPairAnswer<'_>) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into blind_pair_answers (pair_id, answer, response_ms, note, feedback_id, could_have_known, \
         created_at) values (?, ?, ?, ?, ?, ?, ?) on conflict (pair_id) do nothing",
    )
    .bind(id)
    .bind(new.answer.about_gaits())
    .bind(new.response_ms)
    .bind(new.note)
    .bind(new.feedback)
    .bind(new.could_have_known)
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() == 1)
}

/// Retracts the answer about a pair. Returns `false` if it was already retracted.
///
/// # Errors
/// A violated constraint if there is no answer; errors of the database.
pub async fn retract(db: &mut Connection, id: BlindPairId) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into blind_pair_retractions (pair_id, created_at) values (?, ?) \
         on conflict (pair_id) do nothing",
    )
    .bind(id)
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() == 1)
}

/// The entry of the feedback log derived from the answer about a pair.
///
/// # Errors
/// Errors of the database.
pub async fn feedback_of(db: &mut Connection, id: BlindPairId) -> StoreResult<Option<FeedbackId>> {
    let row =
        sqlx::query("select feedback_id from blind_pair_answers where pair_id = ?").bind(id).fetch_optional(db).await?;
    Ok(row.map(|row| row.try_get(0)).transpose()?.flatten())
}

/// Selects blind pairs, with the answer as retracted if its author retracted it.
pub(super) const SELECT: &str = "select p.*, iif(r.pair_id is null, a.answer, 'retracted') as answer, \
                      a.created_at as answered_at, coalesce(a.note, '') as note, \
                      p.unblinded or coalesce(a.could_have_known, 0) as could_have_known from blind_pairs p \
                      left join blind_pair_answers a on a.pair_id = p.id \
                      left join blind_pair_retractions r on r.pair_id = p.id ";

/// The blind pairs of two trials in either order, in the order of the draws.
///
/// # Errors
/// Errors of the database.
pub async fn of_pair(db: &mut Connection, (a, b): (TrialId, TrialId)) -> StoreResult<Vec<BlindPair>> {
    let pair = "(p.trial_a = ?1 and p.trial_b = ?2) or (p.trial_a = ?2 and p.trial_b = ?1)";
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} where {pair} order by p.id"));
    let rows = sqlx::query(sql).bind(a).bind(b).fetch_all(db).await?;
    rows.iter().map(BlindPair::from_row).collect()
}

/// Every pair of a study, in the order of the draws.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<BlindPair>> {
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} where p.study_id = ? order by p.id"));
    let rows = sqlx::query(sql).bind(study).fetch_all(db).await?;
    rows.iter().map(BlindPair::from_row).collect()
}

/// The blind pairs of a study whose answer is an assessment and was not retracted, in the order of the draws.
///
/// # Errors
/// Errors of the database.
pub async fn assessments_of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<BlindPair>> {
    let assessments: Vec<&str> =
        OrderedAnswer::ALL.iter().filter(|answer| answer.is_assessment()).map(|answer| answer.about_gaits()).collect();
    let assessments = assessments.join("', '");
    let sql =
        format!("{SELECT} where p.study_id = ? and a.answer in ('{assessments}') and r.pair_id is null order by p.id");
    let rows = sqlx::query(sqlx::AssertSqlSafe(sql)).bind(study).fetch_all(db).await?;
    rows.iter().map(BlindPair::from_row).collect()
}

/// Records that a rater was unblinded.
///
/// # Errors
/// Errors of the database.
pub async fn unblind(db: &mut Connection, study: StudyId, rater: &str, actor: &str, reason: &str) -> StoreResult<()> {
    sqlx::query("insert into rater_unblindings (study_id, rater, actor, reason, created_at) values (?, ?, ?, ?, ?)")
        .bind(study)
        .bind(rater)
        .bind(actor)
        .bind(reason)
        .bind(now())
        .execute(db)
        .await?;
    Ok(())
}

/// Whether a rater was unblinded in a study.
///
/// # Errors
/// Errors of the database.
pub async fn is_unblinded(db: &mut Connection, study: StudyId, rater: &str) -> StoreResult<bool> {
    let row = sqlx::query("select 1 from rater_unblindings where study_id = ? and rater = ? limit 1")
        .bind(study)
        .bind(rater)
        .fetch_optional(db)
        .await?;
    Ok(row.is_some())
}

impl BlindPair {
    pub(super) fn from_row(row: &SqliteRow) -> StoreResult<Self> {
        Ok(Self {
            id: row.try_get("id")?,
            code: row.try_get("code")?,
            study_id: row.try_get("study_id")?,
            rater: row.try_get("rater")?,
            number: row.try_get("number")?,
            kind: row.try_get::<&str, _>("kind")?.parse()?,
            trial_a: row.try_get("trial_a")?,
            trial_b: row.try_get("trial_b")?,
            repeats: row.try_get("repeats")?,
            could_have_known: row.try_get("could_have_known")?,
            created_at: row.try_get("created_at")?,
            answer: row.try_get::<Option<&str>, _>("answer")?.map(OrderedAnswer::from_gaits).transpose()?,
            answered_at: row.try_get("answered_at")?,
            note: row.try_get("note")?,
        })
    }
}
