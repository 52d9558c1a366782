//! Every row that says something is sealed, and what another hand touches is found.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::seals::{self, SealCheck};
use gaitwright_store::{Store, StoreError, audit, backup, verify as store_verify};
use gaitwright_tests::every_table::filled;
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
use sqlx::{AssertSqlSafe, Connection, Row};
use std::path::{Path, PathBuf};

async fn open(database: &Path) -> SqliteConnection {
    let options = SqliteConnectOptions::new().filename(database).foreign_keys(false);
    SqliteConnection::connect_with(&options).await.unwrap()
}

async fn verify(database: &Path) -> SealCheck {
    let pool = backup::open_read_only(database).await.unwrap();
    seals::verify(&mut pool.acquire().await.unwrap()).await.unwrap()
}

/// A copy of the record in which somebody who knows `SQLite` did this, and left no other trace.
async fn touched(database: &Path, sql: &str) -> PathBuf {
    let copy = database.with_file_name("touched.db");
    std::fs::copy(database, &copy).unwrap();
    let mut connection = open(&copy).await;
    let triggers = sqlx::query("select name, sql from sqlite_master where type = 'trigger'");
    let triggers = triggers.fetch_all(&mut connection).await.unwrap();
    for trigger in &triggers {
        let drop = format!("drop trigger {}", trigger.get::<&str, _>(0));
        sqlx::query(AssertSqlSafe(drop)).execute(&mut connection).await.unwrap();
    }
    sqlx::query("pragma ignore_check_constraints = on").execute(&mut connection).await.unwrap();
    let done = sqlx::query(AssertSqlSafe(sql.to_owned())).execute(&mut connection).await.unwrap();
    assert!(done.rows_affected() > 0, "{sql}");
    for trigger in &triggers {
        sqlx::query(AssertSqlSafe(trigger.get::<String, _>(1))).execute(&mut connection).await.unwrap();
    }
    connection.close().await.unwrap();
    copy
}

#[tokio::test]
async fn a_row_that_another_hand_changed_added_or_took_away_is_found() {
    let (_folder, database) = filled().await;
    assert!(matches!(verify(&database).await, SealCheck::Whole { .. }));
    for sealed in seals::TABLES {
        let (table, key) = (sealed.table, sealed.key[0]);
        let written = if table == "results" { "received_at" } else { "created_at" };
        for sql in [
            format!("update {table} set {written} = {written} || '0' where {key} = (select max({key}) from {table})"),
            format!("delete from {table} where {key} = (select max({key}) from {table})"),
        ] {
            let found = verify(&touched(&database, &sql).await).await;
            assert!(matches!(&found, SealCheck::Touched { table: named, .. } if named == table), "{sql}: {found:?}");
        }
    }
    for (sql, table) in [
        ("update gaits set gait = x'00'", "gaits"),
        ("update trials set gait_rmse_rad = gait_rmse_rad + 1e-12", "trials"),
        ("update studies set seed = seed + 1", "studies"),
        ("update users set role = 'admin'", "users"),
        (
            "insert into feedback (id, study_id, kind, trial_a, trial_b, source, author, created_at) \
             select 'x', study_id, 'tie', min(id), max(id), 'subject', 'K', '' from trials group by study_id",
            "feedback",
        ),
    ] {
        let found = verify(&touched(&database, sql).await).await;
        assert!(matches!(&found, SealCheck::Touched { table: named, .. } if named == table), "{sql}: {found:?}");
    }
}

#[tokio::test]
async fn seals_and_audit_rows_that_are_missing_are_found_at_the_end_too() {
    let (_folder, database) = filled().await;
    let SealCheck::Whole { seals: count, .. } = verify(&database).await else { panic!("whole") };
    let count = i64::try_from(count).unwrap();
    for (sql, seq) in [
        (format!("delete from seals where seq = {count}"), count),
        ("delete from seals where seq = 3".to_owned(), 4),
        ("update seals set sha256 = '' where seq = 5".to_owned(), 5),
    ] {
        assert_eq!(verify(&touched(&database, &sql).await).await, SealCheck::Broken { seq }, "{sql}");
    }
    let cut = touched(&database, "delete from audit where seq = (select max(seq) from audit)").await;
    let pool = backup::open_read_only(&cut).await.unwrap();
    let found = audit::verify(&mut pool.acquire().await.unwrap()).await.unwrap();
    assert!(matches!(found, audit::ChainCheck::Broken { .. }), "{found:?}");
}

/// A row like another one, with a key of its own.
async fn forged(connection: &mut SqliteConnection, table: &str, key: &[&str]) -> String {
    // Empty where nobody signs in.
    let whole_row = match table {
        "clock" => Some("1, '2000-01-01T00:00:00.000Z'"),
        "sign_in_failures" => Some("'ada', '192.0.2.1', 1, '2000-01-01T00:00:00.000Z', '2000-01-01T00:00:00.000Z'"),
        "sign_in_sources" => Some("'192.0.2.0', 1, 1, '2000-01-01T00:00:00.000Z', '2000-01-01T00:00:00.000Z'"),
        _ => None,
    };
    if let Some(row) = whole_row {
        return format!("insert or replace into {table} values ({row})");
    }
    let columns = "select name from pragma_table_info(?) order by cid";
    let columns: Vec<String> = sqlx::query_scalar(columns).bind(table).fetch_all(connection).await.unwrap();
    let last = *key.last().unwrap();
    let value = |column: &String| match (table, column.as_str()) {
        (_, column) if column == last && ["seq", "attempt", "version", "format_version"].contains(&last) => {
            format!("{column} + 1000")
        }
        (_, column) if column == last && ["feedback_seq", "number"].contains(&last) => format!("{column} + 1000"),
        ("lab_acts", "act") => "'closed'".to_owned(),
        ("presentations" | "trials" | "lab_sessions", "number") => format!("{column} + 1000"),
        (_, "hash" | "token") => "hex(randomblob(32))".to_owned(),
        ("feedback", "kind") => "'tie'".to_owned(),
        (_, "id" | "sha256" | "pseudonym" | "name") | ("jobs", "trial_id") => "hex(randomblob(8))".to_owned(),
        (_, column) if column == last => "hex(randomblob(8))".to_owned(),
        (_, column) => column.to_owned(),
    };
    let values: Vec<String> = columns.iter().map(value).collect();
    format!("insert into {table} ({}) select {} from {table} limit 1", columns.join(", "), values.join(", "))
}

#[tokio::test]
async fn a_forged_row_of_any_table_keeps_the_record_from_opening() {
    let (_folder, database) = filled().await;
    let (mut tables, mut found) = (0, 0);
    for sealed in seals::TABLES.iter().chain(seals::CHECKED) {
        let table = sealed.table;
        let sql = forged(&mut open(&database).await, table, sealed.key).await;
        let copy = touched(&database, &sql).await;
        let before = std::fs::read(&copy).unwrap();
        let refused = Store::open(&copy).await;
        tables += 1;
        let at_open = matches!(&refused, Err(StoreError::Unsealed { table: named, .. }) if named == table);
        let newer = table == "_sqlx_migrations" && matches!(&refused, Err(StoreError::NewerSchema { .. }));
        assert!(at_open || newer, "{sql}: {:?}", refused.err());
        let refused = store_verify::file(&copy, &[]).await;
        assert!(refused.is_err(), "{sql}");
        assert_eq!(std::fs::read(&copy).unwrap(), before, "{sql}: nothing was changed");
        found += 1;
    }
    println!("{found} of {tables} forged rows found at open and by audit verify");
}

#[tokio::test]
async fn a_changed_row_of_a_table_with_checksums_is_found() {
    let (_folder, database) = filled().await;
    store_verify::file(&database, &[]).await.unwrap();
    for (sql, table) in [
        ("update events set payload = '{}' where seq = 1", "events"),
        ("delete from events where seq = 1", "events"),
        ("update jobs set failures = 1", "jobs"),
        ("update sessions set by_link = 1", "sessions"),
        ("update sign_in_links set expires_at = '9999'", "sign_in_links"),
        ("update idempotency_keys set body = 'x'", "idempotency_keys"),
        ("delete from idempotency_keys", "idempotency_keys"),
        ("update _sqlx_migrations set execution_time = 7", "_sqlx_migrations"),
    ] {
        let found = verify(&touched(&database, sql).await).await;
        assert!(matches!(&found, SealCheck::Touched { table: named, .. } if named == table), "{sql}: {found:?}");
    }
    let copy = touched(&database, "update events set payload = '{}' where seq = 1").await;
    let mut connection = open(&copy).await;
    sqlx::query("drop trigger feedback_no_update").execute(&mut connection).await.unwrap();
    connection.close().await.unwrap();
    let refused = store_verify::file(&copy, &[]).await.unwrap_err().to_string();
    assert!(refused.contains("trigger feedback_no_update"), "{refused}");
}

#[tokio::test]
async fn every_table_is_sealed_or_has_checksums() {
    let (_folder, database) = filled().await;
    let tables = "select name from sqlite_master where type = 'table' and name not glob 'sqlite_*'";
    let mut connection = open(&database).await;
    for row in sqlx::query(tables).fetch_all(&mut connection).await.unwrap() {
        let table: &str = row.get(0);
        let mut known = seals::TABLES.iter().chain(seals::CHECKED);
        let known = known.any(|sealed| sealed.table == table) || seals::NOT_SEALED.contains(&table);
        assert!(known, "{table}: name it in store/seals.rs, in TABLES or in CHECKED");
    }
}
