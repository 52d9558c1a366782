//! Records that earlier versions wrote, each with a row in every table, opened by this one.
//!
//! Each of `tests/records` was written at the commit that added it, with
//! `cargo run -p gaitwright-tests --example every_table -- tests/records/v7.db.zst`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::{SCHEMA_VERSION, Store, StoreError, read_only, verify};
use gaitwright_tests::archives::exported;
use gaitwright_tests::cli;
use serde_json::{Value, json};
use sqlx::sqlite::{SqliteConnectOptions, SqlitePool};
use sqlx::{AssertSqlSafe, Row};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;

const V1: &[u8] = include_bytes!("../records/v1.db.zst");
/// Tables that sign-in alone fills, and the example does not.
const OF_SIGN_IN: [&str; 3] = ["clock", "sign_in_failures", "sign_in_sources"];
/// The records that are kept, by the form in which they were written.
const RECORDS: [(i64, &[u8]); 9] = [
    (1, V1),
    (7, include_bytes!("../records/v7.db.zst")),
    (8, include_bytes!("../records/v8.db.zst")),
    (9, include_bytes!("../records/v9.db.zst")),
    (10, include_bytes!("../records/v10.db.zst")),
    (11, include_bytes!("../records/v11.db.zst")),
    (12, include_bytes!("../records/v12.db.zst")),
    (13, include_bytes!("../records/v13.db.zst")),
    (14, include_bytes!("../records/v14.db.zst")),
];

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

/// Tables and columns that a migration renamed.
const RENAMED: [(&str, &str); 5] = [
    ("remarks", "assessments"),
    ("remark_retractions", "assessment_retractions"),
    ("remark_id", "assessment_id"),
    ("lab_recordings", "measurement_files"),
    ("verdict", "decision"),
];

fn present_name(old: &str) -> String {
    RENAMED.iter().find(|(before, _)| *before == old).map_or(old, |(_, after)| after).to_owned()
}

/// All rows of the old version exist, and the record is intact.
async fn assert_upgraded(database: &Path, old: &Path) {
    let old_layout = layout(old).await;
    let present = |(table, columns): (&String, &Vec<String>)| {
        (present_name(table), columns.iter().map(|column| present_name(column)).collect())
    };
    let (before, after) =
        (rows(old, &old_layout).await, rows(database, &old_layout.iter().map(present).collect()).await);
    for (table, rows) in &before {
        assert!(!rows.is_empty() || OF_SIGN_IN.contains(&table.as_str()), "{table} has rows");
        let missing: Vec<_> = rows.iter().filter(|row| !after[&present_name(table)].contains(row)).collect();
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
async fn upgrade_keeps_the_allocations_of_the_baseline() {
    let (_folder, database) = unpacked(V1);
    Store::open(&database).await.unwrap().close().await;
    let pool = open(&database).await;
    for (of, unlike) in [
        (
            "lab_sessions",
            "select count(*) from lab_sessions l left join lab_allocations a on a.session_id = l.id \
             where a.gait_one_first is not l.gait_one_first",
        ),
        (
            "presentations",
            "select count(*) from presentations p left join presentation_allocations a on a.presentation_id = p.id \
             where a.swapped is not 0",
        ),
    ] {
        let rows: i64 =
            sqlx::query_scalar(AssertSqlSafe(format!("select count(*) from {of}"))).fetch_one(&pool).await.unwrap();
        let unlike: i64 = sqlx::query_scalar(unlike).fetch_one(&pool).await.unwrap();
        assert!(rows > 0 && unlike == 0, "{of}: {unlike} of {rows} have another order");
    }
    pool.close().await;
}

/// The lines of an archive.
fn lines(archive: &[u8]) -> Vec<Value> {
    let name = archive.iter().position(|byte| *byte == b'\n').unwrap();
    let text = String::from_utf8(zstd::decode_all(&archive[name + 1..]).unwrap()).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[tokio::test]
async fn archive_of_an_upgraded_record_omits_the_allocations_of_the_baseline() {
    let (_folder, database) = unpacked(V1);
    let store = Store::open(&database).await.unwrap();
    let mut reader = store.read().await.unwrap();
    let drawn: Vec<(String, bool)> =
        sqlx::query_as("select study_id, gait_one_first from lab_sessions").fetch_all(&mut **reader).await.unwrap();
    drop(reader);
    assert!(drawn.iter().any(|(_, first)| *first), "there is nothing to leave out: {drawn:?}");
    let mut archived = 0;
    for (study, _) in &drawn {
        for line in lines(&exported(&store, study.parse().unwrap()).await) {
            if let Some(order) = line.pointer("/row/gait_one_first").filter(|_| line["table"] == "lab_sessions") {
                archived += 1;
                assert_eq!(*order, json!(0), "{line}");
            }
        }
    }
    assert!(archived >= drawn.len(), "{archived} of {} sessions are in archives", drawn.len());
    store.close().await;
}

#[tokio::test]
async fn upgrade_keeps_a_copy_of_the_old_record() {
    let (folder, database) = unpacked(V1);
    let old = folder.path().join("old.db");
    std::fs::copy(&database, &old).unwrap();
    Store::open(&database).await.unwrap().close().await;
    let copy = folder.path().join("a.db.v1");
    assert_eq!(versions(&copy).await, [1]);
    read_only::check(&copy).await.unwrap();
    let layout = layout(&old).await;
    assert_eq!(rows(&copy, &layout).await, rows(&old, &layout).await);

    // The same record again: the copy that is there is the one.
    let kept = std::fs::read(&copy).unwrap();
    for name in ["a.db-wal", "a.db-shm", "a.db.anchor"] {
        let _ = std::fs::remove_file(folder.path().join(name));
    }
    std::fs::copy(&old, &database).unwrap();
    Store::open(&database).await.unwrap().close().await;
    assert_eq!(std::fs::read(&copy).unwrap(), kept);
    assert!(!cli::files(folder.path()).iter().any(|name| name.contains("v1-2") || name.contains("copying")));
}

#[tokio::test]
async fn killed_upgrade_is_repeated_by_the_next_start() {
    let old_folder = tempfile::tempdir().unwrap();
    let old = old_folder.path().join("old.db");
    std::fs::write(&old, zstd::decode_all(V1).unwrap()).unwrap();
    let (mut in_time, mut late) = (0, 0);
    for kill in 0..15 {
        let (folder, database) = unpacked(V1);
        let mut process = Command::new(env!("CARGO_BIN_EXE_serve-analytic"))
            .arg(&database)
            .arg("127.0.0.1:0")
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(4 * kill));
        process.kill().unwrap();
        process.wait().unwrap();
        if versions(&database).await == [1] {
            in_time += 1;
        } else {
            late += 1;
        }
        Store::open(&database).await.unwrap().close().await;
        assert_upgraded(&database, &old).await;
        assert_eq!(versions(&folder.path().join("a.db.v1")).await, [1]);
        assert!(
            !cli::files(folder.path()).iter().any(|name| name.contains("copying")),
            "{:?}",
            cli::files(folder.path())
        );
    }
    println!("killed before the upgrade was durable: {in_time}, after: {late}");
    assert!(in_time > 0);
}

#[tokio::test]
async fn upgrade_does_not_seal_a_forged_row() {
    let (_folder, database) = unpacked(V1);
    let pool = SqlitePool::connect_with(SqliteConnectOptions::new().filename(&database)).await.unwrap();
    sqlx::query("insert into consents (subject_id, kind, note, actor, created_at) select id, 'given', 'x', 'x', '' from subjects limit 1")
        .execute(&pool)
        .await
        .unwrap();
    pool.close().await;
    let refused = Store::open(&database).await.unwrap_err().to_string();
    assert!(refused.contains("of consents"), "{refused}");
    assert_eq!(versions(&database).await, [1], "the record is as it was");
}

#[tokio::test]
async fn record_with_a_study_whose_setting_this_version_lacks_is_refused() {
    for (form, record) in RECORDS {
        let (_folder, database) = unpacked(record);
        let pool = SqlitePool::connect_with(SqliteConnectOptions::new().filename(&database)).await.unwrap();
        let sql = "update studies set learner = json_set(learner, '$.additive_share', 0.3) where id = (select max(id) from studies)";
        assert_eq!(sqlx::query(sql).execute(&pool).await.unwrap().rows_affected(), 1);
        pool.close().await;
        let before = std::fs::read(&database).unwrap();
        let refused = Store::open(&database).await.unwrap_err();
        let StoreError::FormerSetting { setting, value, .. } = &refused else { panic!("{refused:?}") };
        assert_eq!((*setting, value.as_str()), ("additive_share", "0.3"));
        assert_eq!(versions(&database).await.last(), Some(&form));
        assert_eq!(std::fs::read(&database).unwrap(), before, "{form}: nothing was changed");
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
        // Without the first or the last one, it is a record of another program or of an earlier version.
        assert!(refused.contains(&found) || missing == 1 || missing == SCHEMA_VERSION, "{missing}: {refused}");
        assert_eq!(std::fs::read(&database).unwrap(), before, "{missing}: nothing was changed");
    }
}
