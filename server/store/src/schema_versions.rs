//! The versions of the schema: numbered SQL files, embedded, and which of them a file has.

use super::{Connection, StoreError, StoreResult};
use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::{Row, SqlSafeStr, SqlitePool};
use std::borrow::Cow;
use std::path::Path;

/// Version, description and text of a migration.
pub(super) type SchemaFile = (i64, &'static str, &'static str);

/// The migrations. Never edit a released file; add the next one.
pub(super) const FILES: &[SchemaFile] = &[(1, "baseline", include_str!("../migrations/0001_baseline.sql"))];

/// Newest schema version.
pub const SCHEMA_VERSION: i64 = FILES[FILES.len() - 1].0;

/// Creates the schema in an empty database.
pub(super) async fn fresh(db: &mut Connection) -> StoreResult<()> {
    Ok(migrator(FILES).run_direct(None, db, false).await?)
}

/// The migrations up to a version.
pub(super) fn up_to(newest: i64) -> Migrator {
    migrator(&FILES.iter().copied().filter(|(version, ..)| *version <= newest).collect::<Vec<_>>())
}

/// These migrations.
pub(super) fn migrator(files: &[SchemaFile]) -> Migrator {
    let migrations = files
        .iter()
        .map(|&(version, description, sql)| {
            let description = Cow::Borrowed(description);
            Migration::new(version, description, MigrationType::Simple, sql.into_sql_str(), false)
        })
        .collect();
    Migrator::with_migrations(migrations)
}

/// The schema version of a file. Refuses files of other programs, of development versions with other migrations and of
/// newer versions, and a list of migrations with a gap, because the missing migrations would be applied again and their
/// rows sealed.
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
        if let Some(version) = unlike_a_migration(pool).await? {
            return Err(StoreError::DevelopmentSchema { path: path.to_owned(), version });
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
            Err(StoreError::Damaged { what: "migrations", reason })
        }
    }
}

/// The first applied migration whose text differs from the file with its number.
async fn unlike_a_migration(pool: &SqlitePool) -> StoreResult<Option<i64>> {
    for known in migrator(FILES).iter() {
        let unlike = "select 1 from _sqlx_migrations where version = ? and checksum <> ?";
        let unlike = sqlx::query(unlike).bind(known.version).bind(known.checksum.as_ref());
        if unlike.fetch_optional(pool).await?.is_some() {
            return Ok(Some(known.version));
        }
    }
    Ok(None)
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

#[cfg(test)]
mod tests {
    use super::FILES;

    /// A record keeps the hash of each migration, so that a converted text would be another migration.
    #[test]
    fn migrations_have_the_same_line_endings_on_every_machine() {
        assert!(FILES.iter().all(|(_, _, text)| !text.contains('\r')));
    }
}
