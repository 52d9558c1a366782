//! Where studies came from that were not made here.

use super::{Connection, Instant, StoreResult, StudyId, now};
use crate::audit::Actor;
use serde::Serialize;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use utoipa::ToSchema;

/// An import of a study.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
pub struct Import {
    /// SHA-256 of the archive.
    pub file_sha256: String,
    /// Public key of whoever signed the archive; `None`: it is not signed.
    pub signed_by: Option<String>,
    /// Whether the import named that key as one to trust.
    pub trusted: bool,
    /// Trials with a Gait RMSE that could not be computed anew, because the archive has no gait of theirs.
    pub unchecked_rmse: u32,
    /// Who imported it.
    pub actor: String,
    /// When.
    pub imported_at: Instant,
}

/// What is to be noted of an import.
#[derive(Debug, Clone)]
pub struct NewImport {
    /// SHA-256 of the archive.
    pub file_sha256: String,
    /// Public key of whoever signed it.
    pub signed_by: Option<String>,
    /// Whether that key is trusted.
    pub trusted: bool,
    /// Trials whose Gait RMSE could not be computed anew.
    pub unchecked_rmse: u32,
}

/// Notes an import.
///
/// # Errors
/// What the database reports.
pub async fn insert(db: &mut Connection, study: StudyId, actor: &Actor, new: &NewImport) -> StoreResult<()> {
    sqlx::query(
        "insert into imports (study_id, file_sha256, signed_by, trusted, unchecked_rmse, actor, created_at) \
         values (?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(study)
    .bind(&new.file_sha256)
    .bind(&new.signed_by)
    .bind(new.trusted)
    .bind(new.unchecked_rmse)
    .bind(actor.as_str())
    .bind(now())
    .execute(db)
    .await?;
    Ok(())
}

/// The imports of a study, the first one first: one for each record that it came through.
///
/// # Errors
/// What the database reports.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<Import>> {
    let rows = sqlx::query("select * from imports where study_id = ? order by seq").bind(study).fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

fn from_row(row: &SqliteRow) -> StoreResult<Import> {
    Ok(Import {
        file_sha256: row.try_get("file_sha256")?,
        signed_by: row.try_get("signed_by")?,
        trusted: row.try_get("trusted")?,
        unchecked_rmse: row.try_get("unchecked_rmse")?,
        actor: row.try_get("actor")?,
        imported_at: row.try_get("created_at")?,
    })
}
