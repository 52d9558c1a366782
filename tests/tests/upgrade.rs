//! Records that each schema version wrote, with a row in every table, opened by this version.
//!
//! Each of `tests/records` was written at the commit that added it, with
//! `cargo run -p gaitwright-tests --example every_table -- tests/records/v1.db.zst`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::{SCHEMA_VERSION, Store, StoreError, read_only, verify};
use gaitwright_tests::cli;
use sqlx::sqlite::{SqliteConnectOptions, SqlitePool};
use sqlx::{AssertSqlSafe, Row};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;

/// Tables that sign-in alone fills, and the example does not.
const OF_SIGN_IN: [&str; 3] = ["clock", "sign_in_failures", "sign_in_sources"];
/// The stored records, by schema version.
const RECORDS: [(i64, &[u8]); 1] = [(1, include_bytes!("../records/v1.db.zst"))];

fn unpacked(record: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    std::fs::write(&database, zstd::decode_all(record).unwrap()).unwrap();
    (folder, database)
}

async fn open(database: &Path) -> SqlitePool {
    let options = SqliteConnectOptions::new().filename(database).read_only(true);
    SqlitePool::connect_with(options).await.unwrap()
}

async fn versions(database: &Path) -> Vec<i64> {
    let pool = open(database).await;
    let found = sqlx::query_scalar("select version from _sqlx_migrations order by version").fetch_all(&pool).await;
    pool.close().await;
    found.unwrap()
}

/// The columns of each table.
async fn layout(database: &Path) -> BTreeMap<String, Vec<String>> {
    let pool = open(database).await;
    let sql = "select m.name, c.name from sqlite_master m, pragma_table_info(m.name) c where m.type = 'table' order by 1, c.cid";
    let mut layout = BTreeMap::<String, Vec<String>>::new();
    for row in sqlx::query(sql).fetch_all(&pool).await.unwrap() {
        layout.entry(row.get(0)).or_default().push(row.get(1));
    }
    pool.close().await;
    layout
}

/// Every row of these columns as SQL literals.
async fn rows(database: &Path, layout: &BTreeMap<String, Vec<String>>) -> BTreeMap<String, Vec<String>> {
    let pool = open(database).await;
    let mut all = BTreeMap::new();
    for (table, columns) in layout {
        let columns: Vec<String> = columns.iter().map(|column| format!("quote({column})")).collect();
        let sql = format!("select {} as row from {table} order by row", columns.join(" || ',' || "));
        let rows: Vec<String> = sqlx::query_scalar(AssertSqlSafe(sql)).fetch_all(&pool).await.unwrap();
        all.insert(table.clone(), rows);
    }
    pool.close().await;
    all
}

/// All rows of the old version exist, and the record is intact.
async fn assert_upgraded(database: &Path, old: &Path) {
    let layout = layout(old).await;
    let (before, after) = (rows(old, &layout).await, rows(database, &layout).await);
    for (table, rows) in &before {
        assert!(!rows.is_empty() || OF_SIGN_IN.contains(&table.as_str()), "{table} has rows");
        let missing: Vec<_> = rows.iter().filter(|row| !after[table].contains(row)).collect();
        // Rows that the new version adds at start, and the counters of the database.
        assert!(missing.is_empty() || table == "sqlite_sequence", "{table}: {missing:?}");
    }
    assert_eq!(versions(database).await.last(), Some(&SCHEMA_VERSION));
    verify::file(database, &[]).await.unwrap();
}

#[test]
fn record_with_the_present_schema_is_stored_for_the_next_upgrade() {
    assert_eq!(RECORDS.last().unwrap().0, SCHEMA_VERSION, "write one with the example every_table");
}

#[tokio::test]
async fn every_row_of_each_kept_record_survives_the_upgrade() {
    for (form, record) in RECORDS {
        let (folder, database) = unpacked(record);
        let old = folder.path().join("old.db");
        std::fs::copy(&database, &old).unwrap();
        assert_eq!(versions(&old).await.last(), Some(&form));
        verify::file(&old, &[]).await.unwrap();
        Store::open(&database).await.unwrap().close().await;
        assert_upgraded(&database, &old).await;
    }
}

#[tokio::test]
async fn killed_creation_of_a_record_is_repeated_by_the_next_start() {
    let (mut in_time, mut late) = (0, 0);
    for kill in 0..15 {
        let folder = tempfile::tempdir().unwrap();
        let database = folder.path().join("a.db");
        let mut process = Command::new(env!("CARGO_BIN_EXE_serve-analytic"))
            .arg(&database)
            .arg("127.0.0.1:0")
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(4 * kill));
        process.kill().unwrap();
        process.wait().unwrap();
        if read_only::check(&database).await.is_ok() {
            late += 1;
        } else {
            in_time += 1;
        }
        Store::open(&database).await.unwrap().close().await;
        assert_eq!(versions(&database).await.last(), Some(&SCHEMA_VERSION));
        verify::file(&database, &[]).await.unwrap();
        let left = cli::files(folder.path());
        assert!(!left.iter().any(|name| name.contains("copying")), "{left:?}");
    }
    println!("killed before the record was durable: {in_time}, after: {late}");
    assert!(in_time > 0);
}

#[tokio::test]
async fn record_of_a_development_version_is_refused() {
    let (_, newest) = RECORDS[RECORDS.len() - 1];
    let other_text = "update _sqlx_migrations set checksum = x'00' where version = 1";
    let more = "insert into _sqlx_migrations (version, description, success, checksum, execution_time) \
                values (9998, 'names', 1, x'00', 0)";
    for changes in [&[other_text][..], &[other_text, more]] {
        let (_folder, database) = unpacked(newest);
        let pool = SqlitePool::connect_with(SqliteConnectOptions::new().filename(&database)).await.unwrap();
        for sql in changes {
            sqlx::query(*sql).execute(&pool).await.unwrap();
        }
        pool.close().await;
        let before = std::fs::read(&database).unwrap();
        for refused in [
            Store::open(&database).await.map(drop),
            read_only::check(&database).await,
            verify::file(&database, &[]).await.map(drop),
        ] {
            let refused = refused.unwrap_err();
            assert!(matches!(refused, StoreError::DevelopmentSchema { version: 1, .. }), "{refused}");
            let text = refused.to_string();
            assert!(text.contains("is from a development version") && text.contains("Nothing was changed"), "{text}");
        }
        assert_eq!(std::fs::read(&database).unwrap(), before, "nothing was changed");
    }
}

#[tokio::test]
async fn record_with_a_missing_migration_is_refused() {
    let (_, newest) = RECORDS[RECORDS.len() - 1];
    for missing in 1..=SCHEMA_VERSION {
        let (_folder, database) = unpacked(newest);
        let pool = SqlitePool::connect_with(SqliteConnectOptions::new().filename(&database)).await.unwrap();
        let forget = "delete from _sqlx_migrations where version = ?";
        sqlx::query(forget).bind(missing).execute(&pool).await.unwrap();
        for sql in [
            "insert into sign_in_links (hash, user_id, created_at, expires_at) \
             select substr(hex(zeroblob(32)), 1, 63) || 'f', id, '2000', '2999' from users limit 1",
            "drop table if exists checksums",
        ] {
            sqlx::query(sql).execute(&pool).await.unwrap();
        }
        pool.close().await;
        let before = std::fs::read(&database).unwrap();
        let refused = Store::open(&database).await.unwrap_err().to_string();
        let found = format!("migration {missing} is missing");
        // Without the first one, it is a record of another program; without the last one, of an earlier version.
        assert!(refused.contains(&found) || missing == 1 || missing == SCHEMA_VERSION, "{missing}: {refused}");
        assert_eq!(std::fs::read(&database).unwrap(), before, "{missing}: nothing was changed");
    }
}
