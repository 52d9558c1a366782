//! The schema: numbered SQL files, embedded, applied at start in one go.

use super::{StoreError, StoreResult};
use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::{Row, SqlSafeStr, SqlitePool};
use std::borrow::Cow;
use std::path::Path;

/// Version, description and text of each migration. An applied file is never edited: add the next one.
const FILES: [(i64, &str, &str); 6] = [
    (1, "studies", include_str!("../../../migrations/0001_studies.sql")),
    (2, "audit", include_str!("../../../migrations/0002_audit.sql")),
    (3, "access", include_str!("../../../migrations/0003_access.sql")),
    (4, "scripts", include_str!("../../../migrations/0004_scripts.sql")),
    (5, "blind", include_str!("../../../migrations/0005_blind.sql")),
    (8, "certificates", include_str!("../../../migrations/0008_certificates.sql")),
];

pub(super) async fn apply(pool: &SqlitePool, path: &Path) -> StoreResult<()> {
    let found = check_version(pool, path).await?;
    back_up_before(pool, path, found).await?;
    let migrations = FILES
        .into_iter()
        .map(|(version, description, sql)| {
            let description = Cow::Borrowed(description);
            Migration::new(version, description, MigrationType::Simple, sql.into_sql_str(), false)
        })
        .collect();
    Migrator::with_migrations(migrations).run(pool).await?;
    Ok(())
}

/// Refuses a file that a newer version of the program wrote; otherwise its version.
pub(super) async fn check_version(pool: &SqlitePool, path: &Path) -> StoreResult<i64> {
    let known = FILES[FILES.len() - 1].0;
    let found = version(pool).await?;
    if found > known {
        return Err(StoreError::NewerSchema { path: path.to_owned(), found, known });
    }
    Ok(found)
}

/// A file that is about to be changed is copied first: `gaitwright.db.v1`.
async fn back_up_before(pool: &SqlitePool, path: &Path, found: i64) -> StoreResult<()> {
    let mut copy = path.as_os_str().to_owned();
    copy.push(format!(".v{found}"));
    if found == 0 || found == FILES[FILES.len() - 1].0 || Path::new(&copy).exists() {
        return Ok(());
    }
    sqlx::query("vacuum into ?").bind(copy.to_string_lossy().into_owned()).execute(pool).await?;
    Ok(())
}

/// The newest migration that was applied; 0 for a fresh file.
async fn version(pool: &SqlitePool) -> StoreResult<i64> {
    let table = sqlx::query("select 1 from sqlite_master where type = 'table' and name = '_sqlx_migrations'")
        .fetch_optional(pool)
        .await?;
    if table.is_none() {
        return Ok(0);
    }
    let row = sqlx::query("select coalesce(max(version), 0) from _sqlx_migrations").fetch_one(pool).await?;
    Ok(row.try_get(0)?)
}
