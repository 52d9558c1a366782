//! Stored answers of subjects in lab sessions, in terms of walks.

use super::audit::Actor;
use super::blind_pairs::OrderedAnswer;
use super::{Connection, Instant, LabSessionId, StoreResult, now};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// An answer of the subject.
#[derive(Debug, Clone, PartialEq)]
pub struct LabAnswer {
    /// Number of the answer, from 1. It increases by one with each retraction.
    pub number: u32,
    /// The answer. First is walk 2.
    pub answer: OrderedAnswer,
    /// Free text.
    pub note: String,
    /// Actor who recorded it.
    pub actor: String,
    /// Time of recording.
    pub at: Instant,
    /// Whether it was retracted.
    pub retracted: bool,
}

/// Adds an answer. Returns `false` if there is one with this number.
///
/// # Errors
/// A violated trigger; errors of the database.
pub async fn insert(
    db: &mut Connection,
    actor: &Actor,
    id: LabSessionId,
    number: u32,
    (answer, note): (OrderedAnswer, &str),
) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into lab_answers (lab_session_id, number, answer, note, actor, created_at) values (?, ?, ?, ?, ?, ?) \
         on conflict (lab_session_id, number) do nothing",
    )
    .bind(id)
    .bind(number)
    .bind(answer.as_str())
    .bind(note)
    .bind(actor.as_str())
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() == 1)
}

/// Retracts an answer. Returns `false` if it was already retracted.
///
/// # Errors
/// A violated constraint if there is no such answer; errors of the database.
pub async fn retract(db: &mut Connection, actor: &Actor, id: LabSessionId, number: u32) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into lab_answer_retractions (lab_session_id, number, actor, created_at) values (?, ?, ?, ?) \
         on conflict (lab_session_id, number) do nothing",
    )
    .bind(id)
    .bind(number)
    .bind(actor.as_str())
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() == 1)
}

/// The answers of a session, in order.
///
/// # Errors
/// Errors of the database.
pub async fn of_session(db: &mut Connection, id: LabSessionId) -> StoreResult<Vec<LabAnswer>> {
    let rows = sqlx::query(
        "select a.*, r.number is not null as retracted from lab_answers a \
         left join lab_answer_retractions r on r.lab_session_id = a.lab_session_id and r.number = a.number \
         where a.lab_session_id = ? order by a.number",
    )
    .bind(id)
    .fetch_all(db)
    .await?;
    rows.iter().map(from_row).collect()
}

fn from_row(row: &SqliteRow) -> StoreResult<LabAnswer> {
    Ok(LabAnswer {
        number: row.try_get("number")?,
        answer: row.try_get::<&str, _>("answer")?.parse()?,
        note: row.try_get("note")?,
        actor: row.try_get("actor")?,
        at: row.try_get("created_at")?,
        retracted: row.try_get("retracted")?,
    })
}
