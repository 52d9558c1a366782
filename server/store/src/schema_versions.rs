//! The versions of the schema: numbered SQL files, embedded, and which of them a file has.

use super::{Connection, StoreError, StoreResult};
use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::{Row, SqlSafeStr, SqlitePool};
use std::borrow::Cow;
use std::path::Path;

/// Version, description and text of each migration. Never edit a file; add the next one.
const FILES: &[(i64, &str, &str)] = &[
    (1, "baseline", include_str!("../migrations/0001_baseline.sql")),
    (2, "checksums", include_str!("../migrations/0002_checksums.sql")),
    (3, "imports", include_str!("../migrations/0003_imports.sql")),
    (4, "sessions", include_str!("../migrations/0004_sessions.sql")),
    (5, "access_log", include_str!("../migrations/0005_access_log.sql")),
    (6, "allocations", include_str!("../migrations/0006_allocations.sql")),
    (7, "study members", include_str!("../migrations/0007_study_members.sql")),
    (8, "role changes", include_str!("../migrations/0008_role_changes.sql")),
    (9, "safety reports", include_str!("../migrations/0009_safety_reports.sql")),
    (10, "suggestions by action", include_str!("../migrations/0010_suggestions_by_action.sql")),
    (11, "reviewed safety reports", include_str!("../migrations/0011_reviewed_safety_reports.sql")),
    (12, "names", include_str!("../migrations/0012_names.sql")),
    (13, "repeat results", include_str!("../migrations/0013_repeat_results.sql")),
    (14, "study lists", include_str!("../migrations/0014_study_lists.sql")),
];

/// Newest schema version.
pub const SCHEMA_VERSION: i64 = FILES[FILES.len() - 1].0;

/// Creates the schema in an empty database.
pub(super) async fn fresh(db: &mut Connection) -> StoreResult<()> {
    Ok(up_to(SCHEMA_VERSION).run_direct(None, db, false).await?)
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

/// The schema version of a file. Refuses files of other programs and of newer versions, and a list of migrations with a
/// gap, because the missing migrations would be applied again and their rows sealed.
pub(super) async fn check_version(pool: &SqlitePool, path: &Path) -> StoreResult<i64> {
    let known = FILES[FILES.len() - 1].0;
    let found = version(pool).await?;
    let foreign = |reason| Err(StoreError::NotADatabase { path: path.to_owned(), reason });
    if found == 0 {
        // A process that was killed while creating the file may leave only the list of migrations.
        let other = "select name from sqlite_master where type = 'table' and name not glob '_sqlx*' limit 1";
        if let Some(row) = sqlx::query(other).fetch_optional(pool).await? {
            return foreign(format!(
                "it belongs to another program: it has the table {:?}",
                row.try_get::<String, _>(0)?
            ));
        }
    } else {
        let first = "select description from _sqlx_migrations where version = 1";
        let first: Option<String> = sqlx::query_scalar(first).fetch_optional(pool).await?;
        if first.as_deref() != Some(FILES[0].1) {
            return foreign("it belongs to another program, which has its own migrations".to_owned());
        }
    }
    if found > known {
        return Err(StoreError::NewerSchema { path: path.to_owned(), found, known });
    }
    let applied = "select version from _sqlx_migrations where success order by version";
    let applied: Vec<i64> = if found == 0 { Vec::new() } else { sqlx::query_scalar(applied).fetch_all(pool).await? };
    match FILES.iter().map(|file| file.0).take_while(|version| *version <= found).find(|v| !applied.contains(v)) {
        None => Ok(found),
        Some(missing) => {
            let reason = format!("its schema has version {found}, but migration {missing} is missing from its list");
            Err(StoreError::Damaged { what: "evidence", reason })
        }
    }
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
