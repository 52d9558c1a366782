//! Consents and withdrawals of subjects.
//!
//! Triggers refuse all new data of a subject who withdrew consent.

use super::audit::Actor;
use super::{Connection, Instant, StoreError, StoreResult, StudyId, SubjectId, now};
use serde::{Deserialize, Serialize};
use sqlx::Row;
use utoipa::ToSchema;

/// Kind of entry: `given`, the subject gave consent; `withdrawn`, the subject withdrew it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConsentKind {
    /// The subject gave consent.
    Given,
    /// The subject withdrew consent.
    Withdrawn,
}

impl ConsentKind {
    /// The name in the record.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Withdrawn => "withdrawn",
        }
    }
}

/// A subject's consent, or withdrawal of consent. The newest entry applies.
#[derive(Debug, Clone, PartialEq)]
pub struct Consent {
    /// Sequence number.
    pub seq: i64,
    /// Consent or withdrawal.
    pub kind: ConsentKind,
    /// For consent, the name and version of the signed form. For a withdrawal, the reason, if the subject gave one.
    pub note: String,
    /// Actor who recorded it.
    pub actor: String,
    /// Time of recording.
    pub created_at: Instant,
}

/// Appends an entry.
///
/// # Errors
/// A violated constraint; errors of the database.
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

/// All entries of a subject, oldest first.
///
/// # Errors
/// Errors of the database.
pub async fn of_subject(db: &mut Connection, subject: SubjectId) -> StoreResult<Vec<Consent>> {
    let rows =
        sqlx::query("select * from consents where subject_id = ? order by seq").bind(subject).fetch_all(db).await?;
    rows.iter()
        .map(|row| {
            let kind = match row.try_get("kind")? {
                "given" => ConsentKind::Given,
                "withdrawn" => ConsentKind::Withdrawn,
                other => return Err(StoreError::unknown_value("consent", other)),
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

/// Whether the subject of a study withdrew consent.
///
/// # Errors
/// Errors of the database.
pub async fn is_withdrawn(db: &mut Connection, study: StudyId) -> StoreResult<bool> {
    let withdrawn =
        sqlx::query("select 1 from studies where id = ? and subject_id in (select subject_id from withdrawn_subjects)")
            .bind(study)
            .fetch_optional(db)
            .await?;
    Ok(withdrawn.is_some())
}

/// Refuses to show or export data of a study whose subject withdrew consent.
///
/// # Errors
/// [`StoreError::Withdrawn`]; errors of the database.
pub async fn may_be_shown(db: &mut Connection, study: StudyId) -> StoreResult<()> {
    if is_withdrawn(db, study).await? { Err(StoreError::Withdrawn) } else { Ok(()) }
}

/// Refuses to show or change what was measured of a subject who withdrew consent.
///
/// # Errors
/// [`StoreError::Withdrawn`]; errors of the database.
pub async fn has_not_withdrawn(db: &mut Connection, subject: SubjectId) -> StoreResult<()> {
    let withdrawn = sqlx::query("select 1 from withdrawn_subjects where subject_id = ?").bind(subject);
    if withdrawn.fetch_optional(db).await?.is_some() { Err(StoreError::Withdrawn) } else { Ok(()) }
}
