//! Stored subjects, under pseudonyms only, with corrections and muscle measurements.

use super::audit::Actor;
use super::{Connection, Instant, StoreError, StoreResult, SubjectId, json_columns, now};
use gait_optimizer::Subject as Body;
use gait_optimizer::muscle::MuscleParameters;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// A subject, known by a pseudonym only.
#[derive(Debug, Clone, PartialEq)]
pub struct SubjectRow {
    /// Identifier.
    pub id: SubjectId,
    /// Unique pseudonym assigned by the site.
    pub pseudonym: String,
    /// Body height, m.
    pub height_m: f64,
    /// Body mass, kg.
    pub body_mass_kg: f64,
    /// Free text.
    pub notes: String,
    /// Time of creation.
    pub created_at: Instant,
}

impl SubjectRow {
    /// Height and mass for the walking model.
    pub fn body(&self) -> Body {
        Body { height_m: self.height_m, body_mass_kg: self.body_mass_kg }
    }
}

/// Selects subjects with their newest correction.
macro_rules! select {
    ($rest:literal) => {
        concat!(
            "select s.id, s.pseudonym, s.notes, s.created_at, coalesce(c.height_m, s.height_m) as height_m, ",
            "coalesce(c.body_mass_kg, s.body_mass_kg) as body_mass_kg from subjects s left join subject_corrections c ",
            "on c.seq = (select max(seq) from subject_corrections where subject_id = s.id) ",
            $rest
        )
    };
}

/// Correction of height and mass.
#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    /// Sequence number.
    pub seq: i64,
    /// Height and mass before the correction.
    pub former: Body,
    /// Corrected body height, m.
    pub height_m: f64,
    /// Corrected body mass, kg.
    pub body_mass_kg: f64,
    /// Reason for the correction.
    pub reason: String,
    /// Actor of the correction.
    pub actor: String,
    /// Time of the correction.
    pub created_at: Instant,
}

/// The unique pseudonym, as SQLite names it in a violation.
pub const PSEUDONYM_UNIQUE: &str = "subjects.pseudonym";

/// Adds a subject.
///
/// # Errors
/// A violated constraint ([`PSEUDONYM_UNIQUE`]); errors of the database.
pub async fn insert(db: &mut Connection, pseudonym: &str, body: Body, notes: &str) -> StoreResult<SubjectRow> {
    let subject = SubjectRow {
        id: SubjectId::fresh(),
        pseudonym: pseudonym.to_owned(),
        height_m: body.height_m,
        body_mass_kg: body.body_mass_kg,
        notes: notes.to_owned(),
        created_at: now(),
    };
    sqlx::query(
        "insert into subjects (id, pseudonym, height_m, body_mass_kg, notes, created_at) values (?, ?, ?, ?, ?, ?)",
    )
    .bind(subject.id)
    .bind(&subject.pseudonym)
    .bind(subject.height_m)
    .bind(subject.body_mass_kg)
    .bind(&subject.notes)
    .bind(subject.created_at)
    .execute(db)
    .await?;
    Ok(subject)
}

/// The subject with this identifier.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn get(db: &mut Connection, id: SubjectId) -> StoreResult<SubjectRow> {
    let row = sqlx::query(select!("where s.id = ?")).bind(id).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()?.ok_or_else(|| StoreError::Missing { what: "subject", id: id.to_string() })
}

/// The subject with this pseudonym, if there is one.
///
/// # Errors
/// Errors of the database.
pub async fn by_pseudonym(db: &mut Connection, pseudonym: &str) -> StoreResult<Option<SubjectRow>> {
    let row = sqlx::query(select!("where s.pseudonym = ?")).bind(pseudonym).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()
}

/// Every subject, newest first.
///
/// # Errors
/// Errors of the database.
pub async fn all(db: &mut Connection) -> StoreResult<Vec<SubjectRow>> {
    let rows = sqlx::query(select!("order by s.id desc")).fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

/// Every subject who has not withdrawn consent, newest first.
///
/// # Errors
/// Errors of the database.
pub async fn consenting(db: &mut Connection) -> StoreResult<Vec<SubjectRow>> {
    let sql = select!("where s.id not in (select subject_id from withdrawn_subjects) order by s.id desc");
    sqlx::query(sql).fetch_all(db).await?.iter().map(from_row).collect()
}

/// At most `limit` subjects added before `before`, newest first.
///
/// # Errors
/// Errors of the database.
pub async fn page(db: &mut Connection, before: Option<SubjectId>, limit: u32) -> StoreResult<Vec<SubjectRow>> {
    let rows = sqlx::query(select!("where ? is null or s.id < ? order by s.id desc limit ?"))
        .bind(before)
        .bind(before)
        .bind(limit)
        .fetch_all(db)
        .await?;
    rows.iter().map(from_row).collect()
}

/// Records a correction.
///
/// # Errors
/// A violated constraint; errors of the database.
pub async fn correct(
    db: &mut Connection,
    actor: &Actor,
    id: SubjectId,
    body: Body,
    reason: &str,
) -> StoreResult<Correction> {
    let at = now();
    let former = get(db, id).await?.body();
    let row = sqlx::query(
        "insert into subject_corrections (subject_id, height_m, body_mass_kg, reason, actor, created_at) \
         values (?, ?, ?, ?, ?, ?) returning seq",
    )
    .bind(id)
    .bind(body.height_m)
    .bind(body.body_mass_kg)
    .bind(reason)
    .bind(actor.as_str())
    .bind(at)
    .fetch_one(db)
    .await?;
    Ok(Correction {
        seq: row.try_get("seq")?,
        former,
        height_m: body.height_m,
        body_mass_kg: body.body_mass_kg,
        reason: reason.to_owned(),
        actor: actor.as_str().to_owned(),
        created_at: at,
    })
}

/// Every correction of a subject, oldest first.
///
/// # Errors
/// Errors of the database.
pub async fn corrections(db: &mut Connection, id: SubjectId) -> StoreResult<Vec<Correction>> {
    let rows = sqlx::query(
        "select c.*, coalesce(lag(c.height_m) over (order by c.seq), s.height_m) as previous_height_m, \
         coalesce(lag(c.body_mass_kg) over (order by c.seq), s.body_mass_kg) as previous_body_mass_kg \
         from subject_corrections c join subjects s on s.id = c.subject_id where c.subject_id = ? order by c.seq",
    )
    .bind(id);
    let correction = |row: &SqliteRow| {
        Ok(Correction {
            seq: row.try_get("seq")?,
            former: Body {
                height_m: row.try_get("previous_height_m")?,
                body_mass_kg: row.try_get("previous_body_mass_kg")?,
            },
            height_m: row.try_get("height_m")?,
            body_mass_kg: row.try_get("body_mass_kg")?,
            reason: row.try_get("reason")?,
            actor: row.try_get("actor")?,
            created_at: row.try_get("created_at")?,
        })
    };
    rows.fetch_all(db).await?.iter().map(correction).collect()
}

/// The measured muscle values of a subject, which override the default ones.
///
/// # Errors
/// Errors of the database.
pub async fn muscles(db: &mut Connection, id: SubjectId) -> StoreResult<MuscleParameters> {
    let row = sqlx::query("select definition from subject_muscles where subject_id = ? order by seq desc limit 1")
        .bind(id)
        .fetch_optional(db)
        .await?;
    Ok(row.as_ref().map(|row| json_columns::column(row, "definition")).transpose()?.unwrap_or_default())
}

/// Records measured muscle values.
///
/// # Errors
/// A violated constraint; errors of the database.
pub async fn set_muscles(
    db: &mut Connection,
    actor: &Actor,
    id: SubjectId,
    muscles: &MuscleParameters,
) -> StoreResult<()> {
    sqlx::query("insert into subject_muscles (subject_id, definition, actor, created_at) values (?, ?, ?, ?)")
        .bind(id)
        .bind(json_columns::to_text("muscle parameters", muscles)?)
        .bind(actor.as_str())
        .bind(now())
        .execute(db)
        .await?;
    Ok(())
}

fn from_row(row: &SqliteRow) -> StoreResult<SubjectRow> {
    Ok(SubjectRow {
        id: row.try_get("id")?,
        pseudonym: row.try_get("pseudonym")?,
        height_m: row.try_get("height_m")?,
        body_mass_kg: row.try_get("body_mass_kg")?,
        notes: row.try_get("notes")?,
        created_at: row.try_get("created_at")?,
    })
}
