//! A record that an earlier version of the program wrote: copied, then brought up to date, with nothing lost.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright::store::audit::{self, Verdict};
use gaitwright::store::studies::{Evaluation, StudyState};
use gaitwright::store::{backup, seals};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::json;
use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::sqlite::{SqliteConnectOptions, SqlitePool};
use sqlx::{AssertSqlSafe, Row, SqlSafeStr};
use std::borrow::Cow;
use std::path::Path;

/// The schema of the first version that people used.
const FIRST: [(i64, &str, &str); 2] = [
    (1, "studies", include_str!("../../migrations/0001_studies.sql")),
    (2, "audit", include_str!("../../migrations/0002_audit.sql")),
];

/// Its tables, each after those it points at.
const TABLES: [&str; 11] = [
    "subjects",
    "devices",
    "reference_gaits",
    "studies",
    "trials",
    "gaits",
    "feedback",
    "retractions",
    "jobs",
    "events",
    "audit",
];

async fn open(database: &Path) -> SqlitePool {
    let options = SqliteConnectOptions::new().filename(database).create_if_missing(true);
    SqlitePool::connect_with(options).await.unwrap()
}

async fn columns(pool: &SqlitePool, table: &str) -> Vec<String> {
    let sql = "select name from pragma_table_info(?) order by cid";
    sqlx::query_scalar(sql).bind(table).fetch_all(pool).await.unwrap()
}

/// The rows of a table as SQL literals, of these columns.
async fn rows(pool: &SqlitePool, table: &str, columns: &[String]) -> Vec<String> {
    let all: Vec<String> = columns.iter().map(|column| format!("quote({column})")).collect();
    let sql = format!("select {} from {table} order by 1", all.join(" || ',' || "));
    let rows = sqlx::query(AssertSqlSafe(sql)).fetch_all(pool).await.unwrap();
    rows.iter().map(|row| row.try_get(0).unwrap()).collect()
}

/// Writes a record of the first version with the rows that a record of today has for it.
async fn write_old(database: &Path, from: &Path) {
    let migrations = FIRST
        .into_iter()
        .map(|(version, name, sql)| {
            Migration::new(version, Cow::Borrowed(name), MigrationType::Simple, sql.into_sql_str(), false)
        })
        .collect();
    let pool =
        SqlitePool::connect_with(SqliteConnectOptions::new().filename(database).create_if_missing(true)).await.unwrap();
    Migrator::with_migrations(migrations).run(&pool).await.unwrap();
    let mut connection = pool.acquire().await.unwrap();
    sqlx::query("attach ? as today").bind(from.to_str().unwrap()).execute(&mut *connection).await.unwrap();
    for table in TABLES {
        let columns = columns(&pool, table).await.join(", ");
        let sql = format!("insert into {table} ({columns}) select {columns} from today.{table} order by rowid");
        sqlx::query(AssertSqlSafe(sql)).execute(&mut *connection).await.unwrap();
    }
    drop(connection);
    pool.close().await;
}

async fn versions(database: &Path) -> Vec<i64> {
    let pool = open(database).await;
    let found = sqlx::query_scalar("select version from _sqlx_migrations order by version").fetch_all(&pool).await;
    pool.close().await;
    found.unwrap()
}

#[tokio::test]
async fn an_old_record_is_copied_and_brought_up_to_date_with_every_row() {
    let folder = tempfile::tempdir().unwrap();
    let today = folder.path().join("today.db");
    let service = Service::start(&today, Analytic::default(), 1).await;
    let study = service.study(|new| new.trial_budget = 6).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let answer = json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "a"});
    let given = service.post(&format!("/api/v1/studies/{study}/preferences"), &answer).await.json();
    let retract = format!("/api/v1/preferences/{}/retract", given["id"].as_str().unwrap());
    assert_eq!(service.post(&retract, &json!({"reason": "mistyped"})).await.status, StatusCode::OK);
    service.stop().await;

    let old = folder.path().join("old.db");
    write_old(&old, &today).await;
    let pool = open(&old).await;
    let (mut layout, mut before) = (Vec::new(), Vec::new());
    for table in TABLES {
        layout.push(columns(&pool, table).await);
        before.push(rows(&pool, table, layout.last().unwrap()).await);
        assert!(!before.last().unwrap().is_empty(), "{table} has rows");
    }
    pool.close().await;

    let service = Service::start_as_is(&old, Analytic::default(), 1).await;
    let copy = folder.path().join("old.db.v2");
    assert_eq!(versions(&copy).await, [1, 2], "the copy is the record as it was");
    backup::check(&copy).await.unwrap();
    let (kept, upgraded) = (open(&copy).await, open(&old).await);
    for ((table, columns), before) in TABLES.iter().zip(&layout).zip(&before) {
        assert_eq!(&rows(&kept, table, columns).await, before, "{table} of the copy");
        assert_eq!(&rows(&upgraded, table, columns).await, before, "{table} of the record");
    }
    backup::check(&old).await.unwrap();
    let verdict = audit::verify(&mut service.store.read().await.unwrap()).await.unwrap();
    assert!(matches!(verdict, Verdict::Whole { rows, .. } if rows == before[10].len() as u64), "{verdict:?}");

    let sealed = seals::verify(&mut service.store.read().await.unwrap()).await.unwrap();
    let is_sealed = |table: &str| seals::TABLES.iter().any(|sealed| sealed.table == table);
    let rows: usize =
        TABLES.iter().zip(&before).filter(|(table, _)| is_sealed(table)).map(|(_, rows)| rows.len()).sum();
    assert!(matches!(sealed, seals::Verdict::Whole { seals, .. } if seals >= rows as u64), "{sealed:?}");
    let unsealed = seals::verify(&mut kept.acquire().await.unwrap()).await.unwrap();
    assert_eq!(unsealed, seals::Verdict::None, "the copy is of a version without seals");

    // The constraint is wider for trials of scripts, and for no other.
    let bare = "update trials set report = null, asked_by = ? where id = ?";
    let loosen = "drop trigger trials_result_fixed";
    sqlx::query(loosen).execute(&upgraded).await.unwrap();
    let of = |script: Option<&'static str>| sqlx::query(bare).bind(script).bind(trials[0].id).execute(&upgraded);
    let refused = of(None).await.unwrap_err().to_string();
    assert!(refused.contains("trials_converged_has_figures"), "{refused}");
    of(Some("rig")).await.unwrap();
    kept.close().await;
    upgraded.close().await;

    // What came with the later versions works on it.
    let script = service.study(|new| (new.trial_budget, new.evaluation) = (2, Evaluation::Script)).await;
    for _ in 0..2 {
        let asked = service.post(&format!("/api/v1/studies/{script}/ask"), &json!({})).await.json();
        let tell = format!("/api/v1/trials/{}/tell", asked["id"].as_str().unwrap());
        let told = service.post(&tell, &json!({"outcome": "converged", "gait_rmse_rad": 0.2})).await;
        assert_eq!(told.status, StatusCode::OK, "{}", told.text);
    }
    service.wait_for(script, &[StudyState::Finished]).await;
    service.stop().await;
}

#[tokio::test]
async fn the_copy_of_an_upgrade_that_broke_off_is_made_anew_and_a_whole_one_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (today, old) = (folder.path().join("today.db"), folder.path().join("old.db"));
    Service::start(&today, Analytic::default(), 1).await.stop().await;
    write_old(&old, &today).await;
    // What a process leaves that is killed while it copies.
    std::fs::write(folder.path().join("old.db.v2.part"), b"SQLite format 3\0 and no more").unwrap();
    Service::start_as_is(&old, Analytic::default(), 1).await.stop().await;
    let copy = folder.path().join("old.db.v2");
    assert_eq!(versions(&copy).await, [1, 2]);
    assert!(!folder.path().join("old.db.v2.part").exists());

    // The same record put back: its copy is there already.
    let kept = std::fs::read(&copy).unwrap();
    std::fs::copy(&copy, &old).unwrap();
    for rest in ["-wal", "-shm"] {
        let _ = std::fs::remove_file(folder.path().join(format!("old.db{rest}")));
    }
    Service::start_as_is(&old, Analytic::default(), 1).await.stop().await;
    assert_eq!(std::fs::read(&copy).unwrap(), kept);
    assert!(!folder.path().join("old.db.v2-2").exists());

    // Another record of that version under the same name: both copies are kept.
    std::fs::copy(&copy, &old).unwrap();
    let pool = open(&old).await;
    sqlx::query("update subjects set notes = 'went on'").execute(&pool).await.unwrap();
    pool.close().await;
    Service::start_as_is(&old, Analytic::default(), 1).await.stop().await;
    assert_eq!(std::fs::read(&copy).unwrap(), kept);
    backup::check(&folder.path().join("old.db.v2-2")).await.unwrap();
}
