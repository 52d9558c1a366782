//! Stored lab sessions and their progress. The order of the gaits is an allocation (`super::allocations`).

use super::accessible_studies::{reach_values, reached};
use super::allocations::{self, SessionAllocation};
use super::audit::Actor;
use super::lab_answers::{self, LabAnswer};
use super::{Connection, Instant, LabSessionId, StoreError, StoreResult, StudyId, TrialId, now};
use crate::accessible_studies::Reach;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use std::str::FromStr;

/// A step of a session, which happens at most once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionStep {
    /// Walk 1, 2 or 3 was recorded.
    Walk(u8),
    /// The session was unblinded.
    Unblinded,
    /// The session was closed.
    Closed,
}

impl SessionStep {
    const ALL: [Self; 5] = [Self::Walk(1), Self::Walk(2), Self::Walk(3), Self::Unblinded, Self::Closed];

    fn as_str(self) -> &'static str {
        match self {
            Self::Walk(1) => "walk_1",
            Self::Walk(2) => "walk_2",
            Self::Walk(_) => "walk_3",
            Self::Unblinded => "unblinded",
            Self::Closed => "closed",
        }
    }
}

impl FromStr for SessionStep {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        Self::ALL
            .into_iter()
            .find(|step| step.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("step of a lab session", text))
    }
}

/// Completed step of a session.
#[derive(Debug, Clone, PartialEq)]
pub struct LabSessionStep {
    /// Reason or note.
    pub note: String,
    /// Actor of the step.
    pub actor: String,
    /// Time of the step.
    pub at: Instant,
}

/// A stored session. `studies::lab` decides what may be shown.
#[derive(Debug, Clone, PartialEq)]
pub struct LabSession {
    /// Identifier.
    pub id: LabSessionId,
    /// Identifier of the study.
    pub study_id: StudyId,
    /// Number in the study, from 1.
    pub number: u32,
    /// The trial with gait A.
    pub trial_a: TrialId,
    /// The trial with gait B.
    pub trial_b: TrialId,
    /// The part of its allocation that may be known.
    pub allocation: SessionAllocation,
    /// Free text.
    pub notes: String,
    /// Actor who planned it.
    pub actor: String,
    /// Time of planning.
    pub created_at: Instant,
    /// Completed steps, in order.
    pub steps: Vec<(SessionStep, LabSessionStep)>,
    /// Answers of the subject, in order.
    pub answers: Vec<LabAnswer>,
}

impl LabSession {
    /// A step, if it is completed.
    pub fn done(&self, step: SessionStep) -> Option<&LabSessionStep> {
        self.steps.iter().find(|(known, _)| *known == step).map(|(_, done)| done)
    }

    /// The current answer, which was not retracted.
    pub fn answer(&self) -> Option<&LabAnswer> {
        self.answers.last().filter(|answer| !answer.retracted)
    }

    /// The gaits of walks 2 and 3; `None` while the session is blinded.
    pub fn walked(&self) -> Option<(TrialId, TrialId)> {
        let gait_a_first = self.allocation.gait_a_first?;
        Some(if gait_a_first { (self.trial_a, self.trial_b) } else { (self.trial_b, self.trial_a) })
    }
}

/// A session to add.
#[derive(Debug, Clone)]
pub struct UnsavedLabSession<'a> {
    /// Identifier of the study.
    pub study_id: StudyId,
    /// Number in the study, from 1.
    pub number: u32,
    /// The trial with gait A.
    pub trial_a: TrialId,
    /// The trial with gait B.
    pub trial_b: TrialId,
    /// Free text.
    pub notes: &'a str,
}

/// Adds a session.
///
/// # Errors
/// A violated constraint; errors of the database.
pub async fn insert(db: &mut Connection, actor: &Actor, new: &UnsavedLabSession<'_>) -> StoreResult<LabSessionId> {
    let id = LabSessionId::fresh();
    sqlx::query(
        "insert into lab_sessions (id, study_id, number, trial_a, trial_b, notes, actor, created_at) \
         values (?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(id)
    .bind(new.study_id)
    .bind(new.number)
    .bind(new.trial_a)
    .bind(new.trial_b)
    .bind(new.notes)
    .bind(actor.as_str())
    .bind(now())
    .execute(db)
    .await?;
    Ok(id)
}

/// Records a step of a session. Returns `false` if it was already recorded.
///
/// # Errors
/// Errors of the database.
pub async fn add_step(
    db: &mut Connection,
    actor: &Actor,
    id: LabSessionId,
    step: SessionStep,
    note: &str,
) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into lab_session_steps (lab_session_id, step, note, actor, created_at) values (?, ?, ?, ?, ?) \
         on conflict (lab_session_id, step) do nothing",
    )
    .bind(id)
    .bind(step.as_str())
    .bind(note)
    .bind(actor.as_str())
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() == 1)
}

/// The session with this identifier.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn get(db: &mut Connection, id: LabSessionId) -> StoreResult<LabSession> {
    let row = sqlx::query("select * from lab_sessions where id = ?").bind(id).fetch_optional(&mut *db).await?;
    let row = row.ok_or_else(|| StoreError::Missing { what: "lab session", id: id.to_string() })?;
    whole(db, &row).await
}

/// The sessions of a study, in order.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<LabSession>> {
    let query = sqlx::query("select * from lab_sessions where study_id = ? order by number").bind(study);
    let rows = query.fetch_all(&mut *db).await?;
    all(db, &rows).await
}

/// Sessions of accessible studies that are open or were closed after `since`, newest first, without those of subjects
/// who withdrew consent.
///
/// # Errors
/// Errors of the database.
pub async fn open_since(db: &mut Connection, reach: Reach, limit: u32, since: Instant) -> StoreResult<Vec<LabSession>> {
    let (every, open, principal) = reach_values(reach);
    let rows = sqlx::query(concat!(
        "select l.* from lab_sessions l join studies s on s.id = l.study_id \
         where s.subject_id not in (select subject_id from withdrawn_subjects) \
         and not exists (select 1 from lab_session_steps a where a.lab_session_id = l.id and a.step = 'closed' \
         and a.created_at < ?5) and ",
        reached!("s.id"),
        " order by l.id desc limit ?4"
    ))
    .bind(every)
    .bind(open)
    .bind(principal)
    .bind(limit)
    .bind(since)
    .fetch_all(&mut *db)
    .await?;
    all(db, &rows).await
}

async fn all(db: &mut Connection, rows: &[SqliteRow]) -> StoreResult<Vec<LabSession>> {
    let mut found = Vec::with_capacity(rows.len());
    for row in rows {
        found.push(whole(db, row).await?);
    }
    Ok(found)
}

async fn whole(db: &mut Connection, row: &SqliteRow) -> StoreResult<LabSession> {
    let id: LabSessionId = row.try_get("id")?;
    let steps = sqlx::query("select * from lab_session_steps where lab_session_id = ? order by rowid").bind(id);
    let steps = steps.fetch_all(&mut *db).await?;
    let step = |row: &SqliteRow| -> StoreResult<(SessionStep, LabSessionStep)> {
        let done =
            LabSessionStep { note: row.try_get("note")?, actor: row.try_get("actor")?, at: row.try_get("created_at")? };
        Ok((row.try_get::<&str, _>("step")?.parse()?, done))
    };
    Ok(LabSession {
        id,
        study_id: row.try_get("study_id")?,
        number: row.try_get("number")?,
        trial_a: row.try_get("trial_a")?,
        trial_b: row.try_get("trial_b")?,
        allocation: allocations::session(&mut *db, id).await?,
        notes: row.try_get("notes")?,
        actor: row.try_get("actor")?,
        created_at: row.try_get("created_at")?,
        steps: steps.iter().map(step).collect::<StoreResult<_>>()?,
        answers: lab_answers::of_session(db, id).await?,
    })
}
