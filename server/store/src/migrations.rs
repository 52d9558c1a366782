//! Migrations of the schema: numbered SQL files, embedded and applied at start in one transaction.

use super::{Connection, StoreError, StoreResult, backup, beside, seals};
use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::{Row, SqlSafeStr, SqlitePool};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Version, description and text of each migration. Never edit a file; add the next one.
const FILES: &[(i64, &str, &str)] = &[
    (1, "baseline", include_str!("../../../migrations/0001_baseline.sql")),
    (2, "checksums", include_str!("../../../migrations/0002_checksums.sql")),
    (3, "imports", include_str!("../../../migrations/0003_imports.sql")),
    (4, "sessions", include_str!("../../../migrations/0004_sessions.sql")),
    (5, "access_log", include_str!("../../../migrations/0005_access_log.sql")),
    (6, "allocations", include_str!("../../../migrations/0006_allocations.sql")),
    (7, "study members", include_str!("../../../migrations/0007_study_members.sql")),
    (8, "role changes", include_str!("../../../migrations/0008_role_changes.sql")),
];

/// Newest schema version.
pub const FORM: i64 = FILES[FILES.len() - 1].0;

/// Length of the header of an SQLite file.
const SQLITE_HEADER_BYTES: usize = 100;

/// Migrates a record and seals the rows that the migrations wrote, in one transaction. Refuses a record with a row that
/// this program did not write, and leaves it unchanged.
pub(super) async fn apply(pool: &SqlitePool, path: &Path) -> StoreResult<()> {
    let found = check_version(pool, path).await?;
    back_up_before(pool, path, found).await?;
    let mut change = pool.begin().await?;
    let before = seals::present(&mut change).await?;
    seals::watch(&mut change).await?;
    up_to(FORM).run_direct(None, &mut *change, false).await?;
    seals::adopt(&mut change, &before).await?;
    seals::refuse_unsealed(&mut change).await?;
    Ok(change.commit().await?)
}

/// Creates the schema in an empty database.
pub(super) async fn fresh(db: &mut Connection) -> StoreResult<()> {
    Ok(up_to(FORM).run_direct(None, db, false).await?)
}

/// The migrations up to a version.
pub(super) fn up_to(newest: i64) -> Migrator {
    let migrations = FILES
        .iter()
        .filter(|(version, ..)| *version <= newest)
        .map(|&(version, description, sql)| {
            let description = Cow::Borrowed(description);
            Migration::new(version, description, MigrationType::Simple, sql.into_sql_str(), false)
        })
        .collect();
    Migrator::with_migrations(migrations)
}

/// The schema version of a file. Refuses files of other programs and of newer versions.
pub(super) async fn check_version(pool: &SqlitePool, path: &Path) -> StoreResult<i64> {
    let known = FILES[FILES.len() - 1].0;
    let found = version(pool).await?;
    let foreign = |reason| Err(StoreError::NotADatabase { path: path.to_owned(), reason });
    if found == 0 {
        // A process that was killed while creating the file may leave only the list of migrations.
        let other = "select name from sqlite_master where type = 'table' and name not glob '_sqlx*' limit 1";
        if let Some(row) = sqlx::query(other).fetch_optional(pool).await? {
            return foreign(format!("it is another program's, with a table {:?}", row.try_get::<String, _>(0)?));
        }
    } else {
        let first = "select description from _sqlx_migrations where version = 1";
        let first: Option<String> = sqlx::query_scalar(first).fetch_optional(pool).await?;
        if first.as_deref() != Some(FILES[0].1) {
            return foreign("it is another program's, with migrations of its own".to_owned());
        }
    }
    if found > known {
        return Err(StoreError::NewerSchema { path: path.to_owned(), found, known });
    }
    Ok(found)
}

/// Backs up a file before a migration, as `gaitwright.db.v1`.
async fn back_up_before(pool: &SqlitePool, path: &Path, found: i64) -> StoreResult<()> {
    if found == 0 || found == FILES[FILES.len() - 1].0 {
        return Ok(());
    }
    let name = beside(path, &format!(".v{found}"));
    let cannot_write = |source| StoreError::Open { path: name.clone(), source };
    let copy = backup::whole_copy(pool, &name, path).await?;
    match free_name(&name, copy.part()).map_err(cannot_write)? {
        Some(free) => copy.keep_as(&free).map_err(cannot_write),
        None => Ok(()),
    }
}

/// The name itself, or with a number if another record has it; `None` if this record was already copied.
fn free_name(name: &Path, part: &Path) -> std::io::Result<Option<PathBuf>> {
    // The header of an SQLite file has a change counter, so compare only what follows it.
    let content =
        |file: &Path| std::fs::read(file).map(|bytes| bytes.into_iter().skip(SQLITE_HEADER_BYTES).collect::<Vec<u8>>());
    let mut candidate = name.to_owned();
    let mut number = 1_u32;
    while candidate.exists() {
        if content(&candidate)? == content(part)? {
            return Ok(None);
        }
        number += 1;
        candidate = beside(name, &format!("-{number}"));
    }
    Ok(Some(candidate))
}

/// The newest applied migration; 0 for a new file.
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
