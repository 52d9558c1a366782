//! Consent of subjects, as it was given and withdrawn.
//!
//! That nothing new is written of a subject who withdrew is the business of triggers: there is no way round them.

use super::audit::Actor;
use super::{Connection, Instant, StoreError, StoreResult, StudyId, SubjectId, now};
use serde::{Deserialize, Serialize};
use sqlx::Row;
use utoipa::ToSchema;

/// What a subject said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConsentKind {
    /// The subject takes part.
    Given,
    /// The subject does not take part any more.
    Withdrawn,
}

impl ConsentKind {
    /// The word in the record.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Withdrawn => "withdrawn",
        }
    }
}

/// A row of the record of consent; the newest counts.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Consent {
    /// Order.
    pub seq: i64,
    /// What was said.
    pub kind: ConsentKind,
    /// Given: which version of which form was signed. Withdrawn: why, as far as the subject says.
    pub note: String,
    /// Who wrote it down.
    pub actor: String,
    /// When.
    pub created_at: Instant,
}

/// Appends what a subject said.
///
/// # Errors
/// A violated constraint, or what the database reports.
pub async fn append(
    db: &mut Connection,
    subject: SubjectId,
    kind: ConsentKind,
    note: &str,
    actor: &Actor,
) -> StoreResult<Consent> {
    let row = Consent { seq: 0, kind, note: note.to_owned(), actor: actor.as_str().to_owned(), created_at: now() };
    let done = sqlx::query("insert into consents (subject_id, kind, note, actor, created_at) values (?, ?, ?, ?, ?)")
        .bind(subject)
        .bind(kind.as_str())
        .bind(&row.note)
        .bind(&row.actor)
        .bind(row.created_at)
        .execute(db)
        .await?;
    Ok(Consent { seq: done.last_insert_rowid(), ..row })
}

/// Everything that a subject said, oldest first.
///
/// # Errors
/// What the database reports.
pub async fn of_subject(db: &mut Connection, subject: SubjectId) -> StoreResult<Vec<Consent>> {
    let rows =
        sqlx::query("select * from consents where subject_id = ? order by seq").bind(subject).fetch_all(db).await?;
    rows.iter()
        .map(|row| {
            let kind = match row.try_get("kind")? {
                "given" => ConsentKind::Given,
                "withdrawn" => ConsentKind::Withdrawn,
                other => return Err(StoreError::Damaged { what: "consent", reason: other.to_owned() }),
            };
            Ok(Consent {
                seq: row.try_get("seq")?,
                kind,
                note: row.try_get("note")?,
                actor: row.try_get("actor")?,
                created_at: row.try_get("created_at")?,
            })
        })
        .collect()
}

/// Whether the subject of a study withdrew.
///
/// # Errors
/// What the database reports.
pub async fn is_withdrawn(db: &mut Connection, study: StudyId) -> StoreResult<bool> {
    let withdrawn =
        sqlx::query("select 1 from studies where id = ? and subject_id in (select subject_id from withdrawn_subjects)")
            .bind(study)
            .fetch_optional(db)
            .await?;
    Ok(withdrawn.is_some())
}

/// Refuses to show or give out what there is of a study whose subject withdrew.
///
/// # Errors
/// [`StoreError::Withdrawn`], or what the database reports.
pub async fn may_be_shown(db: &mut Connection, study: StudyId) -> StoreResult<()> {
    if is_withdrawn(db, study).await? { Err(StoreError::Withdrawn) } else { Ok(()) }
}
