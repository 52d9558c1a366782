//! Stored devices: models of powered prostheses.

use super::{Connection, DeviceId, Instant, StoreError, StoreResult, json_columns, now};
use gait_optimizer::Device as Definition;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// A device. Changing a definition creates a new device, so that studies keep the one they use.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceRow {
    /// Identifier.
    pub id: DeviceId,
    /// Name shown to users.
    pub name: String,
    /// Definition of the device.
    pub definition: Definition,
    /// Time of creation.
    pub created_at: Instant,
}

/// Finds the row with this definition, or adds it. Returns whether it was added.
///
/// # Errors
/// Errors of the database.
pub async fn ensure(db: &mut Connection, definition: &Definition) -> StoreResult<(DeviceRow, bool)> {
    if let Some(found) = find(db, definition).await? {
        return Ok((found, false));
    }
    let text = json_columns::to_text("device", definition)?;
    let hash = json_columns::sha256(text.as_bytes());
    let added = DeviceRow {
        id: DeviceId::fresh(),
        name: definition.name.clone(),
        definition: definition.clone(),
        created_at: now(),
    };
    sqlx::query("insert into devices (id, name, definition, sha256, created_at) values (?, ?, ?, ?, ?)")
        .bind(added.id)
        .bind(&added.name)
        .bind(text)
        .bind(hash)
        .bind(added.created_at)
        .execute(db)
        .await?;
    Ok((added, true))
}

/// The device with this identifier.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn get(db: &mut Connection, id: DeviceId) -> StoreResult<DeviceRow> {
    let row = sqlx::query("select * from devices where id = ?").bind(id).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()?.ok_or_else(|| StoreError::Missing { what: "device", id: id.to_string() })
}

/// Whether a device has this name, ignoring case.
///
/// # Errors
/// Errors of the database.
pub async fn has_name(db: &mut Connection, name: &str) -> StoreResult<bool> {
    let found = sqlx::query("select 1 from devices where lower(trim(name)) = lower(trim(?)) limit 1").bind(name);
    Ok(found.fetch_optional(db).await?.is_some())
}

/// The row with exactly this definition.
///
/// # Errors
/// Errors of the database.
pub async fn find(db: &mut Connection, definition: &Definition) -> StoreResult<Option<DeviceRow>> {
    let hash = json_columns::sha256(json_columns::to_text("device", definition)?.as_bytes());
    let row = sqlx::query("select * from devices where sha256 = ?").bind(hash).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()
}

/// Every device, newest first.
///
/// # Errors
/// Errors of the database.
pub async fn all(db: &mut Connection) -> StoreResult<Vec<DeviceRow>> {
    let rows = sqlx::query("select * from devices order by id desc").fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

fn from_row(row: &SqliteRow) -> StoreResult<DeviceRow> {
    Ok(DeviceRow {
        id: row.try_get("id")?,
        name: row.try_get("name")?,
        definition: json_columns::column(row, "definition")?,
        created_at: row.try_get("created_at")?,
    })
}
