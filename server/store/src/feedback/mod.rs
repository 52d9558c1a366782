//! The feedback log: labels, preferences and suggestions for the learner, append-only.

mod content;
mod origin;

pub use content::{FeedbackContent, Source};
pub use origin::Origin;

use super::many_rows::read_many;
use super::{AnswerId, Connection, FeedbackId, Instant, StoreError, StoreResult, StudyId, TrialId, now};
use gait_learner::ActionIndex;
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Row};

/// Entry of the feedback log.
#[derive(Debug, Clone, PartialEq)]
pub struct FeedbackRow {
    /// Sequence number.
    pub seq: i64,
    /// Identifier.
    pub id: FeedbackId,
    /// Identifier of the study.
    pub study_id: StudyId,
    /// Content of the entry.
    pub content: FeedbackContent,
    /// Source of the entry.
    pub source: Source,
    /// Name or pseudonym of the person who answered.
    pub author: String,
    /// Free text.
    pub note: String,
    /// Whether it comes from a rater's blind comparison.
    pub by_rater: bool,
    /// Whether the rater could have known the allocation. If so, the entry does not count as blind.
    pub could_have_known: bool,
    /// The answer in whose place it was given.
    pub replaces: Option<AnswerId>,
    /// The preference that it brings back, because the change to another answer was undone.
    pub restores: Option<FeedbackId>,
    /// Time of recording.
    pub created_at: Instant,
    /// Retraction, if it was retracted.
    pub retraction: Option<Retraction>,
}

/// Retraction of an answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Retraction {
    /// Author of the retraction.
    pub author: String,
    /// Reason, never empty.
    pub reason: String,
    /// Time of the retraction.
    pub created_at: Instant,
}

impl Retraction {
    /// Reads the columns `retracted_by`, `retracted_because` and `retracted_at`.
    pub(super) fn from_row(row: &SqliteRow) -> StoreResult<Option<Self>> {
        let at: Option<Instant> = row.try_get("retracted_at")?;
        let retraction = |created_at| -> StoreResult<Self> {
            Ok(Self { author: row.try_get("retracted_by")?, reason: row.try_get("retracted_because")?, created_at })
        };
        at.map(retraction).transpose()
    }
}

/// Source, author and note of an entry.
#[derive(Debug, Clone, Copy)]
pub struct Attribution<'a> {
    /// Source.
    pub source: Source,
    /// Author.
    pub author: &'a str,
    /// Free text.
    pub note: &'a str,
}

/// Appends an entry.
///
/// # Errors
/// A violated constraint or trigger; errors of the database.
pub async fn append(
    db: &mut Connection,
    study: StudyId,
    content: &FeedbackContent,
    attribution: Attribution<'_>,
    origin: Origin<FeedbackId>,
) -> StoreResult<FeedbackId> {
    let id = FeedbackId::fresh();
    let (kind, a, b, label, suggested) = match *content {
        FeedbackContent::Label { trial, label } => ("label", trial, None, Some(label.as_str()), None),
        FeedbackContent::Preference { winner, loser } => ("preference", winner, Some(loser), None, None),
        FeedbackContent::NoDifference { a, b } => ("no_difference", a, Some(b), None, None),
        FeedbackContent::Suggestion { suggested, over } => {
            ("suggestion", over, None, None, Some(i64::try_from(suggested.0).unwrap_or(i64::MAX)))
        }
    };
    sqlx::query(
        "insert into feedback (id, study_id, kind, trial_a, trial_b, label, suggested, source, author, note, \
         replaces, restores, created_at) values (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(id)
    .bind(study)
    .bind(kind)
    .bind(a)
    .bind(b)
    .bind(label)
    .bind(suggested)
    .bind(attribution.source.as_str())
    .bind(attribution.author)
    .bind(attribution.note)
    .bind(origin.replaces())
    .bind(origin.restores())
    .bind(now())
    .execute(db)
    .await?;
    Ok(id)
}

/// Retracts an entry, which stays in the log. Returns `false` if it was already retracted.
///
/// # Errors
/// Errors of the database.
pub async fn retract(db: &mut Connection, row: &FeedbackRow, author: &str, reason: &str) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into feedback_retractions (feedback_seq, author, reason, created_at) values (?, ?, ?, ?) \
         on conflict (feedback_seq) do nothing",
    )
    .bind(row.seq)
    .bind(author)
    .bind(reason)
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() == 1)
}

/// Selects entries with their retraction and the rater's blinding.
const SELECT: &str = "select f.*, r.author as retracted_by, r.reason as retracted_because, \
                      r.created_at as retracted_at, \
                      p.pair_id is not null as by_rater, \
                      coalesce(p.could_have_known, 0) or coalesce(q.unblinded, 0) as could_have_known \
                      from feedback f left join feedback_retractions r on r.feedback_seq = f.seq \
                      left join blind_pair_answers p on p.feedback_id = f.id \
                      left join blind_pairs q on q.id = p.pair_id ";

fn select(rest: &str) -> AssertSqlSafe<String> {
    AssertSqlSafe(format!("{SELECT} {rest}"))
}

/// The row with this identifier, if there is one.
///
/// # Errors
/// Errors of the database.
pub async fn find(db: &mut Connection, id: FeedbackId) -> StoreResult<Option<FeedbackRow>> {
    let row = sqlx::query(select("where f.id = ?")).bind(id).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()
}

/// The row with this identifier.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn get(db: &mut Connection, id: FeedbackId) -> StoreResult<FeedbackRow> {
    find(db, id).await?.ok_or_else(|| StoreError::Missing { what: "preference", id: id.to_string() })
}

/// The entry that brings a preference back.
///
/// # Errors
/// Errors of the database.
pub async fn restoration(db: &mut Connection, id: FeedbackId) -> StoreResult<Option<FeedbackId>> {
    Ok(sqlx::query_scalar("select id from feedback where restores = ?").bind(id).fetch_optional(db).await?)
}

/// The entries of a study after a sequence number, retracted ones included, in order.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId, after: i64) -> StoreResult<Vec<FeedbackRow>> {
    let query = sqlx::query(select("where f.study_id = ? and f.seq > ? order by f.seq")).bind(study).bind(after);
    read_many(&query.fetch_all(db).await?, from_row).await
}

/// At most `limit` preferences of a study after a sequence number, retracted ones included, in order.
///
/// # Errors
/// Errors of the database.
pub async fn comparisons(db: &mut Connection, study: StudyId, after: i64, limit: u32) -> StoreResult<Vec<FeedbackRow>> {
    answers(db, study, false, after, limit).await
}

/// At most `limit` suggestions of a study after a sequence number, retracted ones included, in order.
///
/// # Errors
/// Errors of the database.
pub async fn suggestions(db: &mut Connection, study: StudyId, after: i64, limit: u32) -> StoreResult<Vec<FeedbackRow>> {
    answers(db, study, true, after, limit).await
}

async fn answers(
    db: &mut Connection,
    study: StudyId,
    suggestions: bool,
    after: i64,
    limit: u32,
) -> StoreResult<Vec<FeedbackRow>> {
    let rows = sqlx::query(select(
        "where f.study_id = ? and f.kind <> 'label' and (f.kind = 'suggestion') = ? and f.seq > ? order by f.seq limit ?",
    ))
    .bind(study)
    .bind(suggestions)
    .bind(after)
    .bind(limit)
    .fetch_all(db)
    .await?;
    rows.iter().map(from_row).collect()
}

/// The newest answers of people in a study, at most `limit`, in order.
///
/// # Errors
/// Errors of the database.
pub async fn newest_of_people(db: &mut Connection, study: StudyId, limit: u32) -> StoreResult<Vec<FeedbackRow>> {
    let rows = sqlx::query(select(
        "where f.study_id = ? and f.source in ('subject', 'clinician', 'script') order by f.seq desc limit ?",
    ))
    .bind(study)
    .bind(limit)
    .fetch_all(db)
    .await?;
    rows.iter().rev().map(from_row).collect()
}

/// At most `limit` answers of people and scripts about two trials in either order, newest first, without retracted ones
/// and those of one author.
///
/// # Errors
/// Errors of the database.
pub async fn of_pair(
    db: &mut Connection,
    (a, b): (TrialId, TrialId),
    except: Option<&str>,
    limit: u32,
) -> StoreResult<Vec<FeedbackRow>> {
    let rows = sqlx::query(select(
        // Chosen from the index alone, because many people can have answered the same comparison.
        "where f.seq in (select o.seq from feedback o \
         where ((o.trial_a = ?1 and o.trial_b = ?2) or (o.trial_a = ?2 and o.trial_b = ?1)) \
         and (?3 is null or o.author <> ?3) and o.source in ('subject', 'clinician', 'script') \
         and not exists (select 1 from feedback_retractions where feedback_seq = o.seq) order by o.seq desc limit ?4) \
         order by f.seq desc",
    ))
    .bind(a)
    .bind(b)
    .bind(except)
    .bind(limit)
    .fetch_all(db)
    .await?;
    rows.iter().map(from_row).collect()
}

/// The authors of answers about two trials in either order, newest first, without retracted and blind ones.
///
/// # Errors
/// Errors of the database.
pub async fn authors_of_pair(
    db: &mut Connection,
    (a, b): (TrialId, TrialId),
) -> StoreResult<Vec<(FeedbackId, String)>> {
    let rows = sqlx::query(
        "select f.id, f.author from feedback f \
         where ((f.trial_a = ?1 and f.trial_b = ?2) or (f.trial_a = ?2 and f.trial_b = ?1)) \
         and f.source in ('subject', 'clinician', 'script') \
         and not exists (select 1 from feedback_retractions r where r.feedback_seq = f.seq) \
         and not exists (select 1 from blind_pair_answers p where p.feedback_id = f.id) order by f.seq desc",
    )
    .bind(a)
    .bind(b)
    .fetch_all(db)
    .await?;
    rows.iter().map(|row| Ok((row.try_get("id")?, row.try_get("author")?))).collect()
}

const SUGGESTIONS_BETWEEN: &str = "select f.id, f.author from feedback f indexed by feedback_suggestions \
     join trials t on t.id = f.trial_a where f.study_id = ?1 and f.kind = 'suggestion' and f.suggested in (?2, ?3) \
     and ((f.suggested = ?2 and t.action_index = ?3) or (f.suggested = ?3 and t.action_index = ?2)) \
     and not exists (select 1 from feedback_retractions r where r.feedback_seq = f.seq) order by f.seq desc";

/// The authors of suggestions that prefer one of two actions of a study to the other, newest first, without retracted
/// ones.
///
/// # Errors
/// Errors of the database.
pub async fn suggestions_between(
    db: &mut Connection,
    study: StudyId,
    (one, other): (ActionIndex, ActionIndex),
) -> StoreResult<Vec<(FeedbackId, String)>> {
    let [one, other] = [one, other].map(|action| i64::try_from(action.0).unwrap_or(i64::MAX));
    let rows = sqlx::query(SUGGESTIONS_BETWEEN).bind(study).bind(one).bind(other).fetch_all(db).await?;
    rows.iter().map(|row| Ok((row.try_get("id")?, row.try_get("author")?))).collect()
}

/// The version of the feedback log of a study, which changes with every entry and every retraction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LogVersion {
    last: i64,
    retracted: i64,
}

/// The current version.
///
/// # Errors
/// Errors of the database.
pub async fn version(db: &mut Connection, study: StudyId) -> StoreResult<LogVersion> {
    let row = sqlx::query(
        "select coalesce(max(f.seq), 0) as last, count(r.feedback_seq) as retracted \
         from feedback f left join feedback_retractions r on r.feedback_seq = f.seq where f.study_id = ?",
    )
    .bind(study)
    .fetch_one(db)
    .await?;
    Ok(LogVersion { last: row.try_get("last")?, retracted: row.try_get("retracted")? })
}

/// The number of entries of a study.
///
/// # Errors
/// Errors of the database.
pub async fn count(db: &mut Connection, study: StudyId) -> StoreResult<u32> {
    let row = sqlx::query("select count(*) from feedback where study_id = ?").bind(study).fetch_one(db).await?;
    Ok(row.try_get(0)?)
}

fn from_row(row: &SqliteRow) -> StoreResult<FeedbackRow> {
    let a: TrialId = row.try_get("trial_a")?;
    let b: Option<TrialId> = row.try_get("trial_b")?;
    let label: Option<&str> = row.try_get("label")?;
    let suggested: Option<i64> = row.try_get("suggested")?;
    let kind: &str = row.try_get("kind")?;
    let content = match (kind, b, label, suggested) {
        ("label", None, Some(label), None) => FeedbackContent::Label { trial: a, label: label.parse()? },
        ("preference", Some(loser), None, None) => FeedbackContent::Preference { winner: a, loser },
        ("no_difference", Some(b), None, None) => FeedbackContent::NoDifference { a, b },
        ("suggestion", None, None, Some(index)) => {
            FeedbackContent::Suggestion { suggested: ActionIndex(u64::try_from(index).unwrap_or(0)), over: a }
        }
        _ => {
            return Err(StoreError::Damaged {
                what: "feedback",
                reason: format!("an entry of kind {kind} has the wrong columns"),
            });
        }
    };
    Ok(FeedbackRow {
        seq: row.try_get("seq")?,
        id: row.try_get("id")?,
        study_id: row.try_get("study_id")?,
        content,
        source: row.try_get::<&str, _>("source")?.parse()?,
        author: row.try_get("author")?,
        note: row.try_get("note")?,
        by_rater: row.try_get("by_rater")?,
        could_have_known: row.try_get("could_have_known")?,
        replaces: row.try_get("replaces")?,
        restores: row.try_get("restores")?,
        created_at: row.try_get("created_at")?,
        retraction: Retraction::from_row(row)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema_versions;
    use sqlx::{Connection as _, SqliteConnection};

    /// A preference asks this while it holds the only writer.
    #[tokio::test]
    async fn suggestions_between_two_actions_are_found_without_reading_the_answers_of_a_study() {
        let mut db = SqliteConnection::connect(":memory:").await.unwrap();
        schema_versions::fresh(&mut db).await.unwrap();
        let plan = AssertSqlSafe(format!("explain query plan {SUGGESTIONS_BETWEEN}"));
        let steps = sqlx::query(plan).bind("s").bind(1).bind(2).fetch_all(&mut db).await.unwrap();
        let steps: Vec<String> = steps.iter().map(|step| step.get("detail")).collect();
        assert!(steps[0].contains("feedback_suggestions (study_id=? AND suggested=?)"), "{steps:?}");
    }
}
