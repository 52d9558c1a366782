//! The steps of a migration: a backup before it, and the migrations with seals for the rows that they write.

use super::record_file_names::path_with_suffix;
use super::schema_versions::{SchemaFile, migrator};
use super::verified_copy::whole_copy;
use super::{Connection, StoreError, StoreResult, seals};
use sqlx::SqlitePool;
use std::path::{Path, PathBuf};

/// Length of the header of an SQLite file.
const SQLITE_HEADER_BYTES: usize = 100;

/// Migrates a record, and seals the rows that the migrations wrote.
pub(super) async fn apply(db: &mut Connection, files: &[SchemaFile]) -> StoreResult<()> {
    let before = seals::present(db).await?;
    seals::watch_migrations(db).await?;
    migrator(files).run_direct(None, &mut *db, false).await?;
    seals::adopt(db, &before).await?;
    seals::end_watch(db).await
}

/// Backs up a file before a migration, as `gaitwright.db.v1`.
pub(super) async fn back_up_before(pool: &SqlitePool, path: &Path, found: i64) -> StoreResult<()> {
    let name = path_with_suffix(path, &format!(".v{found}"));
    let cannot_write = |source| StoreError::Open { path: name.clone(), source };
    let copy = whole_copy(pool, path, &name, path).await?;
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
        candidate = path_with_suffix(name, &format!("-{number}"));
    }
    Ok(Some(candidate))
}

#[cfg(test)]
mod tests {
    use super::super::audit::Actor;
    use super::super::opening_checks::verify_and_migrate;
    use super::super::schema_versions::{FILES, SCHEMA_VERSION};
    use super::super::{Store, commit, consents, read_only, subjects, verify};
    use super::*;
    use std::ops::AddAssign;
    use tempfile::TempDir;

    /// A migration that the next version could have: it writes rows of a sealed table.
    const NEXT: &str = "alter table subjects add column next text; update subjects set next = 'x';";

    fn with_next(sql: &'static str) -> Vec<SchemaFile> {
        let mut files = FILES.to_vec();
        files.push((SCHEMA_VERSION + 1, "next", sql));
        files
    }

    /// A closed record with a subject who has given consent.
    async fn record() -> (TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let database = folder.path().join("a.db");
        let store = Store::open(&database).await.unwrap();
        let mut writer = store.write().await.unwrap();
        let body = gait_optimizer::Subject { height_m: 1.8, body_mass_kg: 70.0 };
        let subject = subjects::insert(&mut writer, "S1", body, "").await.unwrap();
        consents::append(&mut writer, subject.id, consents::ConsentKind::Given, "form 1", &Actor::program())
            .await
            .unwrap();
        commit(writer).await.unwrap();
        store.close().await;
        (folder, database)
    }

    async fn pool(database: &Path) -> SqlitePool {
        SqlitePool::connect_with(sqlx::sqlite::SqliteConnectOptions::new().filename(database)).await.unwrap()
    }

    async fn versions(database: &Path) -> Vec<i64> {
        let pool = pool(database).await;
        let found = sqlx::query_scalar("select version from _sqlx_migrations order by version").fetch_all(&pool).await;
        pool.close().await;
        found.unwrap()
    }

    fn files(folder: &TempDir) -> Vec<String> {
        let names = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
        let mut names: Vec<String> = names.map(|name| name.into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[tokio::test]
    async fn migration_seals_the_rows_that_it_writes_and_keeps_a_copy_of_the_old_record() {
        let (folder, database) = record().await;
        let old = folder.path().join("old.db");
        std::fs::copy(&database, &old).unwrap();
        let kept = path_with_suffix(&database, &format!(".v{SCHEMA_VERSION}"));
        for _ in 0..2 {
            let migrated = pool(&database).await;
            verify_and_migrate(&migrated, &database, &with_next(NEXT)).await.unwrap();
            let mut db = migrated.acquire().await.unwrap();
            let next: String = sqlx::query_scalar("select next from subjects").fetch_one(&mut *db).await.unwrap();
            assert_eq!(next, "x");
            let sealed = seals::verify(&mut db).await.unwrap();
            assert!(matches!(sealed, seals::SealCheck::Intact { .. }), "{sealed:?}");
            drop(db);
            migrated.close().await;
            assert_eq!(versions(&database).await.last(), Some(&(SCHEMA_VERSION + 1)));
            read_only::check(&kept).await.unwrap();
            verify::file(&kept, &[]).await.unwrap();
            assert_eq!(versions(&kept).await.last(), Some(&SCHEMA_VERSION));
            // The same record again, whose copy is there already.
            std::fs::copy(&old, &database).unwrap();
        }
        let copies = files(&folder).iter().filter(|name| name.contains(".v") || name.contains("copying")).count();
        assert_eq!(copies, 1, "{:?}", files(&folder));
    }

    /// A migration that writes every subject again, many times, so that a kill can meet it at any moment.
    const LARGE: &str = "alter table subjects add column next text; \
        create table copies (id integer primary key, of text not null, padding blob not null) strict; \
        insert into copies (of, padding) select id, randomblob(400) from subjects, \
            (with recursive n(i) as (select 1 union all select i + 1 from n where i < 100) select i from n); \
        update subjects set next = 'x'; drop table copies;";
    /// Subjects of the record that is migrated.
    const SUBJECTS: u32 = 400;
    /// How often the migration is killed.
    const KILLS: u32 = 12;
    /// Names the record to the child process of the test, which migrates it.
    const CHILD: &str = "GAITWRIGHT_TEST_MIGRATES";

    /// The child process of the next test; without its variable, this is no test.
    #[tokio::test]
    async fn child_migrates_the_record_that_it_is_given() {
        let Some(database) = std::env::var_os(CHILD).map(PathBuf::from) else { return };
        let migrated = pool(&database).await;
        verify_and_migrate(&migrated, &database, &with_next(LARGE)).await.unwrap();
        migrated.close().await;
    }

    fn child(database: &Path) -> std::process::Child {
        std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "migrations::tests::child_migrates_the_record_that_it_is_given"])
            .env(CHILD, database)
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null())
            .spawn()
            .unwrap()
    }

    #[tokio::test]
    async fn migration_that_is_killed_at_any_moment_has_happened_or_has_not() {
        let (folder, old) = record().await;
        let store = Store::open(&old).await.unwrap();
        let mut writer = store.write().await.unwrap();
        let body = gait_optimizer::Subject { height_m: 1.8, body_mass_kg: 70.0 };
        for number in 1..SUBJECTS {
            subjects::insert(&mut writer, &format!("S{}", number + 1), body, "").await.unwrap();
        }
        commit(writer).await.unwrap();
        store.close().await;
        // How long an undisturbed migration takes here.
        let database = folder.path().join("killed.db");
        let kept = path_with_suffix(&database, &format!(".v{SCHEMA_VERSION}"));
        std::fs::copy(&old, &database).unwrap();
        let begun = std::time::Instant::now();
        assert!(child(&database).wait().unwrap().success());
        let whole = begun.elapsed();
        assert_eq!(versions(&database).await.last(), Some(&(SCHEMA_VERSION + 1)));

        let (mut copied_before_kill, mut before, mut after) = (0, 0, 0);
        for kill in 0..KILLS {
            for file in files(&folder).iter().filter(|name| name.starts_with("killed.db")) {
                std::fs::remove_file(folder.path().join(file)).unwrap();
            }
            std::fs::copy(&old, &database).unwrap();
            let mut killed = child(&database);
            // Spread over the whole migration, with an offset that no run shares.
            let offset = f64::from(std::process::id() % 97) / 97.0;
            tokio::time::sleep(whole.mul_f64((f64::from(kill) + offset) / f64::from(KILLS))).await;
            killed.kill().unwrap();
            killed.wait().unwrap();

            let found = versions(&database).await;
            let is_new = found.last() == Some(&(SCHEMA_VERSION + 1));
            assert!(is_new || found.last() == Some(&SCHEMA_VERSION), "{found:?}");
            let opened = pool(&database).await;
            let columns: Vec<String> =
                sqlx::query_scalar("select name from pragma_table_info('subjects')").fetch_all(&opened).await.unwrap();
            let copies: Option<String> = sqlx::query_scalar("select name from sqlite_master where name = 'copies'")
                .fetch_optional(&opened)
                .await
                .unwrap();
            let rows: u32 = sqlx::query_scalar("select count(*) from subjects").fetch_one(&opened).await.unwrap();
            assert_eq!((columns.contains(&"next".to_owned()), copies, rows), (is_new, None, SUBJECTS));
            if is_new {
                let written = "select count(*) from subjects where next = 'x'";
                assert_eq!(sqlx::query_scalar::<_, u32>(written).fetch_one(&opened).await.unwrap(), SUBJECTS);
            }
            (if is_new { &mut after } else { &mut before }).add_assign(1);
            // The copy gets its name only once it is whole, and the schema changes only once there is a copy.
            assert!(kept.exists() || !is_new);
            if kept.exists() {
                verify::file(&kept, &[]).await.unwrap();
                assert_eq!(versions(&kept).await.last(), Some(&SCHEMA_VERSION));
                copied_before_kill += 1;
            }
            // The next start completes the migration.
            if !is_new {
                verify_and_migrate(&opened, &database, &with_next(LARGE)).await.unwrap();
            }
            let mut db = opened.acquire().await.unwrap();
            let sealed = seals::verify(&mut db).await.unwrap();
            assert!(matches!(sealed, seals::SealCheck::Intact { .. }), "{sealed:?}");
            let whole: u32 =
                sqlx::query_scalar("select count(*) from subjects where next = 'x'").fetch_one(&mut *db).await.unwrap();
            assert_eq!(whole, SUBJECTS);
            drop(db);
            opened.close().await;
        }
        assert!(before > 0, "{copied_before_kill} copies, {before} before, {after} after");
    }

    #[tokio::test]
    async fn failed_migration_leaves_the_record_as_it_was() {
        let (_folder, database) = record().await;
        let pool = pool(&database).await;
        let failing = "update subjects set notes = 'x'; insert into no_such_table values (1);";
        let failed = verify_and_migrate(&pool, &database, &with_next(failing)).await;
        assert!(matches!(failed, Err(StoreError::Migrate(_))), "{failed:?}");
        pool.close().await;
        assert_eq!(versions(&database).await.last(), Some(&SCHEMA_VERSION));
        verify::file(&database, &[]).await.unwrap();
        let store = Store::open(&database).await.unwrap();
        let found = subjects::all(&mut store.read().await.unwrap()).await.unwrap();
        assert_eq!(found.iter().map(|subject| subject.notes.as_str()).collect::<Vec<_>>(), [""]);
        store.close().await;
    }

    #[tokio::test]
    async fn record_with_a_forged_row_is_not_migrated() {
        let (_folder, database) = record().await;
        let pool = pool(&database).await;
        let forged = "insert into consents (subject_id, kind, note, actor, created_at) \
                      select id, 'given', 'x', 'x', '' from subjects";
        sqlx::query(forged).execute(&pool).await.unwrap();
        let refused = verify_and_migrate(&pool, &database, &with_next(NEXT)).await;
        let Err(StoreError::Unverified { reason, .. }) = &refused else { panic!("{refused:?}") };
        assert!(reason.contains("row 2 of consents has no seal"), "{reason}");
        pool.close().await;
        assert_eq!(versions(&database).await.last(), Some(&SCHEMA_VERSION));
    }
}
