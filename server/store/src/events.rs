//! Events of studies, which event streams can replay from any point.

use super::{Connection, Instant, StoreResult, StudyId, json_columns, now};
use serde::Serialize;
use sqlx::Row;

/// Event of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Sequence number over all studies.
    pub seq: i64,
    /// Identifier of the study.
    pub study_id: StudyId,
    /// Kind of the event: `study_changed`, `trial_queued`, `trial_started`, `trial_ended`, `feedback_given`,
    /// `feedback_retracted`, `lab_session_answered`, `reported_unsafe`, `safety_reviewed`, `gait_certified`, `trial_explained`,
    /// `trial_not_explained`, `execution_reported`.
    pub kind: String,
    /// Details.
    pub payload: serde_json::Value,
    /// Time of the event.
    pub created_at: Instant,
}

/// Appends an event within the transaction of the change.
///
/// # Errors
/// Errors of the database.
pub async fn append<P: Serialize>(
    db: &mut Connection,
    study: StudyId,
    kind: &'static str,
    payload: &P,
) -> StoreResult<()> {
    sqlx::query("insert into events (study_id, kind, payload, created_at) values (?, ?, ?, ?)")
        .bind(study)
        .bind(kind)
        .bind(json_columns::to_text("event", payload)?)
        .bind(now())
        .execute(db)
        .await?;
    Ok(())
}

/// At most `limit` events of a study after a sequence number, in order.
///
/// # Errors
/// Errors of the database.
pub async fn after(db: &mut Connection, study: StudyId, seq: i64, limit: u32) -> StoreResult<Vec<Event>> {
    let rows = sqlx::query("select * from events where study_id = ? and seq > ? order by seq limit ?")
        .bind(study)
        .bind(seq)
        .bind(limit)
        .fetch_all(db)
        .await?;
    rows.iter()
        .map(|row| {
            Ok(Event {
                seq: row.try_get("seq")?,
                study_id: row.try_get("study_id")?,
                kind: row.try_get("kind")?,
                payload: json_columns::column(row, "payload")?,
                created_at: row.try_get("created_at")?,
            })
        })
        .collect()
}

/// The ended studies with events after a sequence number, without those of subjects who withdrew consent; and the
/// newest sequence number.
///
/// # Errors
/// Errors of the database.
pub async fn of_ended_studies(db: &mut Connection, after: i64) -> StoreResult<(Vec<StudyId>, i64)> {
    let newest = sqlx::query_scalar("select coalesce(max(seq), 0) from events").fetch_one(&mut *db).await?;
    let ended = sqlx::query_scalar(
        "select s.id from studies s where s.state in ('finished', 'stopped') \
         and s.subject_id not in (select subject_id from withdrawn_subjects) \
         and exists (select 1 from events e where e.study_id = s.id and e.seq > ?)",
    );
    Ok((ended.bind(after).fetch_all(db).await?, newest))
}

/// The sequence number of the last event of a study; 0 without events.
///
/// # Errors
/// Errors of the database.
pub async fn last(db: &mut Connection, study: StudyId) -> StoreResult<i64> {
    let row =
        sqlx::query("select coalesce(max(seq), 0) from events where study_id = ?").bind(study).fetch_one(db).await?;
    Ok(row.try_get(0)?)
}
