//! Every row that says something is sealed, and what another hand touches is found.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright::store::seals::{self, Verdict};
use gaitwright::store::studies::{FeedbackMode, StudyState};
use gaitwright::store::{audit, backup, commit};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::json;
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
use sqlx::{AssertSqlSafe, Connection, Row};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A record with a row in every table that is sealed.
async fn filled() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start(&database, Analytic::default(), 1).await;
    let study = service.study(|new| (new.trial_budget, new.feedback_mode) = (4, FeedbackMode::Human)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let pair = service.post(&format!("/api/v1/studies/{study}/blind/next"), &json!({})).await.json();
    let answer = format!("/api/v1/blind/{}/answer", pair["pair"]["token"].as_str().unwrap());
    assert_eq!(service.post(&answer, &json!({"answer": "first"})).await.status, StatusCode::CREATED);
    service.wait_for(study, &[StudyState::Waiting]).await;
    let given = service.fetch(&format!("/api/v1/studies/{study}/preferences")).await.json();
    let retract = format!("/api/v1/preferences/{}/retract", given[0]["id"].as_str().unwrap());
    for (path, body) in [
        (retract, json!({"reason": "mistyped"})),
        (format!("/api/v1/subjects/{}/consents", service.subject().await), json!({"form": "form 3"})),
        (format!("/api/v1/studies/{study}/unblind"), json!({"rater": "not signed in", "reason": "asked"})),
        ("/api/v1/users".to_owned(), json!({"name": "R1", "role": "rater"})),
        ("/api/v1/tokens".to_owned(), json!({"name": "rig", "scopes": ["read"]})),
    ] {
        let done = service.post(&path, &body).await;
        assert!(done.status.is_success(), "{path}: {}", done.text);
    }
    let mut writer = service.store.write().await.unwrap();
    for sql in [
        "insert into certificates select trial_id, 1, 1, '{}', created_at from gaits limit 1",
        "insert into explanation_requests (trial_id, actor, created_at) select id, 'K', '' from trials limit 1",
        "insert into explanations (trial_id, program, problem_sha256, document, created_at) \
         select trial_id, 'P', gait_sha256, '{}', created_at from gaits limit 1",
        "insert into presentation_retractions select presentation_id, created_at from presentation_answers limit 1",
        "insert into lab_sessions (id, study_id, number, gait_one, gait_two, gait_one_first, actor, created_at) \
         select 'L', study_id, 1, min(id), max(id), 1, 'K', '' from trials group by study_id",
        "insert into lab_acts (session_id, act, actor, created_at) values ('L', 'walk_1', 'K', '')",
        "insert into lab_answers (session_id, number, answer, actor, created_at) values ('L', 1, 'first', 'K', '')",
        "insert into lab_answer_retractions (session_id, number, actor, created_at) values ('L', 1, 'K', '')",
        "insert into remarks (id, study_id, first, second, answer, source, author, created_at) \
         select 'M', study_id, min(id), max(id), 'cannot_tell', 'clinician', 'K', '' from trials group by study_id",
        "insert into remark_retractions (remark_id, author, reason, created_at) values ('M', 'K', 'r', '')",
        "insert into safety_reviews (id, trial_id, said_until, verdict, author, reason, created_at) \
         select 'I', id, '', 'unsafe', 'K', 'r', '' from trials limit 1",
        "insert into lab_recordings (id, session_id, walk, kind, reading, raw, raw_sha256, actor, created_at) \
         values ('R', 'L', 1, 'motion', '{}', x'00', '', 'K', '')",
        "insert into emg_results (id, session_id, document, actor, created_at) values ('E', 'L', '{}', 'K', '')",
        "insert into subject_muscles (subject_id, definition, actor, created_at) \
         select id, '{}', 'K', '' from subjects limit 1",
    ] {
        sqlx::query(sql).execute(&mut *writer).await.unwrap();
    }
    commit(writer).await.unwrap();
    service.stop().await;
    (folder, database)
}

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
