//! Stored reference gaits, which Gait RMSE is measured against.

use super::{Connection, Instant, ReferenceGaitId, StoreError, StoreResult, json_columns, now};
use gait_optimizer::ReferenceGait as Definition;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// Reference gait. Changing a definition creates a new reference gait, so that studies keep the one they use.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceGaitRow {
    /// Identifier.
    pub id: ReferenceGaitId,
    /// Name shown to users.
    pub name: String,
    /// Definition of the reference gait.
    pub definition: Definition,
    /// Time of creation.
    pub created_at: Instant,
}

/// Finds the row with this definition, or adds it. Returns whether it was added.
///
/// # Errors
/// Errors of the database.
pub async fn ensure(db: &mut Connection, definition: &Definition) -> StoreResult<(ReferenceGaitRow, bool)> {
    let text = json_columns::to_text("reference gait", definition)?;
    let hash = json_columns::sha256(text.as_bytes());
    let found =
        sqlx::query("select * from reference_gaits where sha256 = ?").bind(&hash).fetch_optional(&mut *db).await?;
    if let Some(row) = found {
        return Ok((from_row(&row)?, false));
    }
    let added = ReferenceGaitRow {
        id: ReferenceGaitId::fresh(),
        name: definition.name.clone(),
        definition: definition.clone(),
        created_at: now(),
    };
    sqlx::query("insert into reference_gaits (id, name, definition, sha256, created_at) values (?, ?, ?, ?, ?)")
        .bind(added.id)
        .bind(&added.name)
        .bind(text)
        .bind(hash)
        .bind(added.created_at)
        .execute(db)
        .await?;
    Ok((added, true))
}

/// The reference gait with this identifier.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn get(db: &mut Connection, id: ReferenceGaitId) -> StoreResult<ReferenceGaitRow> {
    let row = sqlx::query("select * from reference_gaits where id = ?").bind(id).fetch_optional(db).await?;
    row.as_ref()
        .map(from_row)
        .transpose()?
        .ok_or_else(|| StoreError::Missing { what: "reference gait", id: id.to_string() })
}

/// Every reference gait, newest first.
///
/// # Errors
/// Errors of the database.
pub async fn all(db: &mut Connection) -> StoreResult<Vec<ReferenceGaitRow>> {
    let rows = sqlx::query("select * from reference_gaits order by id desc").fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

fn from_row(row: &SqliteRow) -> StoreResult<ReferenceGaitRow> {
    Ok(ReferenceGaitRow {
        id: row.try_get("id")?,
        name: row.try_get("name")?,
        definition: json_columns::column(row, "definition")?,
        created_at: row.try_get("created_at")?,
    })
}
