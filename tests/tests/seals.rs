//! Every row that says something is sealed, and what another hand touches is found.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright::store::seals::{self, Verdict};
use gaitwright::store::{audit, backup};
use gaitwright_tests::every_table::filled;
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
use sqlx::{AssertSqlSafe, Connection, Row};
use std::path::{Path, PathBuf};

async fn open(database: &Path) -> SqliteConnection {
    let options = SqliteConnectOptions::new().filename(database).foreign_keys(false);
    SqliteConnection::connect_with(&options).await.unwrap()
}

async fn verify(database: &Path) -> Verdict {
    let pool = backup::open_read_only(database).await.unwrap();
    seals::verify(&mut pool.acquire().await.unwrap()).await.unwrap()
}

/// A copy of the record in which somebody who knows SQLite did this, and left no other trace.
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
    assert!(matches!(verify(&database).await, Verdict::Whole { .. }));
    for sealed in seals::TABLES {
        let (table, key) = (sealed.table, sealed.key[0]);
        let written = if table == "results" { "received_at" } else { "created_at" };
        for sql in [
            format!("update {table} set {written} = {written} || '0' where {key} = (select max({key}) from {table})"),
            format!("delete from {table} where {key} = (select max({key}) from {table})"),
        ] {
            let found = verify(&touched(&database, &sql).await).await;
            assert!(matches!(&found, Verdict::Touched { table: named, .. } if named == table), "{sql}: {found:?}");
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
        assert!(matches!(&found, Verdict::Touched { table: named, .. } if named == table), "{sql}: {found:?}");
    }
}

#[tokio::test]
async fn seals_and_audit_rows_that_are_missing_are_found_at_the_end_too() {
    let (_folder, database) = filled().await;
    let Verdict::Whole { seals: count, .. } = verify(&database).await else { panic!("whole") };
    let count = i64::try_from(count).unwrap();
    for (sql, seq) in [
        (format!("delete from seals where seq = {count}"), count),
        ("delete from seals where seq = 3".to_owned(), 4),
        ("update seals set sha256 = '' where seq = 5".to_owned(), 5),
    ] {
        assert_eq!(verify(&touched(&database, &sql).await).await, Verdict::Broken { seq }, "{sql}");
    }
    let cut = touched(&database, "delete from audit where seq = (select max(seq) from audit)").await;
    let pool = backup::open_read_only(&cut).await.unwrap();
    let found = audit::verify(&mut pool.acquire().await.unwrap()).await.unwrap();
    assert!(matches!(found, audit::Verdict::Broken { .. }), "{found:?}");
}

#[tokio::test]
async fn every_table_is_sealed_or_said_not_to_be() {
    let (_folder, database) = filled().await;
    let tables = "select name from sqlite_master where type = 'table' and name not glob 'sqlite_*' \
                  and name not glob '_sqlx*'";
    let mut connection = open(&database).await;
    for row in sqlx::query(tables).fetch_all(&mut connection).await.unwrap() {
        let table: &str = row.get(0);
        let known = seals::TABLES.iter().any(|sealed| sealed.table == table) || seals::NOT_SEALED.contains(&table);
        assert!(known, "{table}: name it in store/seals.rs, in TABLES or in NOT_SEALED");
    }
}
