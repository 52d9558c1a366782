//! Imports: the origin of studies that were made in another record.

use super::{Connection, Instant, StoreResult, StudyId, now};
use crate::audit::Actor;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// Import of a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Import {
    /// Place in the order of imports.
    pub seq: i64,
    /// SHA-256 of the archive.
    pub file_sha256: String,
    /// Public key of the signer. Absent for an unsigned archive.
    pub signed_by: Option<String>,
    /// Whether the import required a signature by that key.
    pub trusted: bool,
    /// Number of trials whose Gait RMSE could not be checked, because the archive does not have their gaits.
    pub unchecked_rmse: u32,
    /// Actor of the import.
    pub actor: String,
    /// Time of the import.
    pub imported_at: Instant,
}

/// An import to record.
#[derive(Debug, Clone)]
pub struct NewImport {
    /// SHA-256 of the archive.
    pub file_sha256: String,
    /// Public key of the signer.
    pub signed_by: Option<String>,
    /// Whether that key is trusted.
    pub trusted: bool,
    /// Number of trials whose Gait RMSE could not be checked.
    pub unchecked_rmse: u32,
}

/// Records an import.
///
/// # Errors
/// Errors of the database.
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

/// The imports of a study in order, one for each record that it passed through.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<Vec<Import>> {
    let rows = sqlx::query("select * from imports where study_id = ? order by seq").bind(study).fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

/// Whether a study came here, or on its way, in an archive without a trusted signature.
///
/// # Errors
/// Errors of the database.
pub async fn is_untrusted(db: &mut Connection, study: StudyId) -> StoreResult<bool> {
    let sql = "select exists(select 1 from imports where study_id = ? and not trusted)";
    Ok(sqlx::query_scalar(sql).bind(study).fetch_one(db).await?)
}

fn from_row(row: &SqliteRow) -> StoreResult<Import> {
    Ok(Import {
        seq: row.try_get("seq")?,
        file_sha256: row.try_get("file_sha256")?,
        signed_by: row.try_get("signed_by")?,
        trusted: row.try_get("trusted")?,
        unchecked_rmse: row.try_get("unchecked_rmse")?,
        actor: row.try_get("actor")?,
        imported_at: row.try_get("created_at")?,
    })
}
