//! The record: append-only tables, hash chains, backups, and idempotent requests.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, StatusCode};
use gaitwright_store::audit::{self, ChainCheck};
use gaitwright_store::studies::StudyState;
use gaitwright_store::{Store, StoreError, backup, read_only};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::every_table::filled;
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use sqlx::AssertSqlSafe;
use sqlx::sqlite::{SqliteConnectOptions, SqlitePool};
use std::path::Path;
use tempfile::TempDir;

async fn service() -> (TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    (folder, service)
}

async fn post_with_key(service: &Service, path: &str, key: &str, body: &Value) -> Answer {
    let request = Request::post(path)
        .header("content-type", "application/json")
        .header("idempotency-key", key)
        .body(Body::from(body.to_string()))
        .unwrap();
    service.send(request).await
}

async fn audit_rows(service: &Service) -> usize {
    audit::page(&mut service.store.read().await.unwrap(), "", None, 10_000).await.unwrap().len()
}

/// Another program that opens the file and changes it.
async fn intruder(database: &Path) -> SqlitePool {
    SqlitePool::connect_with(SqliteConnectOptions::new().filename(database)).await.unwrap()
}

#[tokio::test]
async fn repeated_request_has_one_effect_and_the_same_response() {
    let (_folder, service) = service().await;
    let body = json!({"pseudonym": "S01", "height_m": 1.8, "body_mass_kg": 70.0});
    let first = post_with_key(&service, "/api/v1/subjects", "key-1", &body).await;
    let second = post_with_key(&service, "/api/v1/subjects", "key-1", &body).await;
    assert_eq!((first.status, &first.text), (StatusCode::CREATED, &second.text));
    assert_eq!(first.headers["location"], second.headers["location"]);
    assert_eq!(second.status, StatusCode::CREATED);
    assert!(second.headers.contains_key("idempotency-replayed") && !first.headers.contains_key("idempotency-replayed"));
    assert_eq!(audit_rows(&service).await, 1);

    let other = json!({"pseudonym": "S02", "height_m": 1.8, "body_mass_kg": 70.0});
    let mistake = post_with_key(&service, "/api/v1/subjects", "key-1", &other).await;
    assert_eq!(mistake.status, StatusCode::CONFLICT);
    // A refused request keeps its key free.
    let bad = json!({"pseudonym": "S02", "height_m": 17.27, "body_mass_kg": 70.0});
    assert_eq!(
        post_with_key(&service, "/api/v1/subjects", "key-2", &bad).await.status,
        StatusCode::UNPROCESSABLE_ENTITY
    );
    assert_eq!(post_with_key(&service, "/api/v1/subjects", "key-2", &other).await.status, StatusCode::CREATED);

    let study = json!({"subject_id": first.json()["id"], "number_of_trials": 1, "start": false});
    let made = post_with_key(&service, "/api/v1/studies", "key-3", &study).await;
    assert_eq!(post_with_key(&service, "/api/v1/studies", "key-3", &study).await.text, made.text);
    assert_eq!(service.fetch("/api/v1/studies").await.items().as_array().unwrap().len(), 1);
    let start = format!("/api/v1/studies/{}/start", made.json()["id"].as_str().unwrap());
    let started = post_with_key(&service, &start, "key-4", &json!({})).await;
    assert_eq!(post_with_key(&service, &start, "key-4", &json!({})).await.text, started.text);
    service.stop().await;
}

#[tokio::test]
async fn every_change_writes_exactly_one_row_of_the_audit_trail() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let held = service.study(|new| (new.number_of_trials, new.start) = (3, false)).await;
    let answer = json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "a"});
    let given = service.post(&format!("/api/v1/studies/{study}/preferences"), &answer).await.json();
    let form = "application/x-www-form-urlencoded";

    let before = audit_rows(&service).await;
    for (count, (path, kind, body)) in [
        (
            "/api/v1/subjects".to_owned(),
            "application/json",
            json!({"pseudonym": "X", "height_m": 1.8, "body_mass_kg": 70}).to_string(),
        ),
        ("/api/v1/studies".to_owned(), "application/json", json!({"subject_id": subject, "start": false}).to_string()),
        (format!("/api/v1/studies/{held}/start"), "application/json", String::new()),
        (format!("/api/v1/studies/{held}/pause"), "application/json", String::new()),
        (format!("/api/v1/studies/{held}/resume"), "application/json", String::new()),
        (format!("/studies/{held}/do"), form, "transition=stop".to_owned()),
        (
            format!("/api/v1/preferences/{}/retract", given["id"].as_str().unwrap()),
            "application/json",
            json!({"reason": "r"}).to_string(),
        ),
        (format!("/api/v1/studies/{study}/preferences"), "application/json", answer.to_string()),
        (
            format!("/studies/{study}/compare"),
            form,
            format!("a={}&b={}&answer=b&source=subject&author=K&key={}", trials[0].id, trials[2].id, trials[0].id),
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let done = service.post_text(&path, kind, &body).await;
        assert!(done.status.is_success() || done.status.is_redirection(), "{path}: {}", done.text);
        assert_eq!(audit_rows(&service).await, before + count + 1, "{path}");
    }
    let check = audit::verify(&mut service.store.read().await.unwrap()).await.unwrap();
    assert!(matches!(check, ChainCheck::Intact { rows, .. } if rows == before as u64 + 9));
    service.stop().await;
}

#[tokio::test]
async fn audit_verify_finds_one_changed_byte_of_the_audit_trail() {
    let (folder, service) = service().await;
    for number in 0..5 {
        let body = json!({"pseudonym": format!("S{number}"), "height_m": 1.8, "body_mass_kg": 70.0});
        service.post("/api/v1/subjects", &body).await;
    }
    service.stop().await;
    let database = folder.path().join("a.db");
    let mut bytes = std::fs::read(&database).unwrap();
    let needle = b"\"pseudonym\":\"S2\"";
    let places: Vec<usize> = (0..bytes.len() - needle.len()).filter(|&i| bytes[i..].starts_with(needle)).collect();
    assert_eq!(places.len(), 1);
    bytes[places[0] + needle.len() - 2] = b'7';
    std::fs::write(&database, bytes).unwrap();
    let pool = read_only::open(&database).await.unwrap();
    let check = audit::verify(&mut pool.acquire().await.unwrap()).await.unwrap();
    assert_eq!(check, ChainCheck::Broken { seq: 3 });
}

#[tokio::test]
async fn evidence_tables_are_append_only_for_other_programs() {
    let (folder, service) = service().await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    service.stop().await;
    let pool = intruder(&folder.path().join("a.db")).await;
    // A trial without a result, because for any other trial the trigger that protects results fires before the one that
    // protects proposals.
    let cancelled = "insert into trials (id, study_id, number, action_index, action, reason, state, created_at, \
                     finished_at) select 'X', study_id, 99, 1, action, reason, 'cancelled', created_at, created_at \
                     from trials limit 1";
    sqlx::query(cancelled).execute(&pool).await.unwrap();
    // The test checks the reason, because an invalid statement would fail, too.
    for (sql, reason) in [
        ("update feedback set author = 'x'", "feedback is append-only"),
        ("delete from feedback", "feedback is append-only"),
        ("update audit set actor = 'x'", "the audit trail is append-only"),
        ("delete from audit", "the audit trail is append-only"),
        ("update events set kind = 'x'", "events are append-only"),
        ("delete from events", "events are append-only"),
        ("update gaits set speed_m_s = 0", "gaits are never changed"),
        ("delete from trials", "trials are never deleted"),
        ("update trials set gait_rmse_rad = 0.001", "the result of a trial cannot be changed"),
        ("update trials set action_index = 0 where id = 'X'", "the proposal of a trial cannot be changed"),
    ] {
        match sqlx::query(sql).execute(&pool).await {
            Err(sqlx::Error::Database(refused)) => assert_eq!(refused.message(), reason, "{sql}"),
            other => panic!("{sql}: {other:?}"),
        }
    }
}

/// The code SQLITE_CONSTRAINT_TRIGGER.
const BY_TRIGGER: &str = "1811";

/// Tables whose rows may be updated. Other triggers protect the plan of a study, and the proposal and result of a trial.
const UPDATED: [&str; 17] = [
    "_sqlx_migrations",
    "checksums",
    "clock",
    "devices",
    "idempotency_keys",
    "reference_gaits",
    "sessions",
    "sign_in_failures",
    "sign_in_links",
    "sign_in_sources",
    "solve_inputs",
    "solve_jobs",
    "studies",
    "subjects",
    "tokens",
    "trials",
    "users",
];

/// Tables whose rows may be deleted: gaits and their local optima only by `prune`, which needs no update.
fn may_be_deleted(table: &str) -> bool {
    ["gaits", "other_local_optima"].contains(&table)
        || UPDATED.contains(&table) && !["tokens", "trials", "users"].contains(&table)
}

#[tokio::test]
async fn every_append_only_table_refuses_updates_and_deletions_of_other_programs() {
    let (_folder, database) = filled().await;
    let pool = intruder(&database).await;
    let names = "select name from sqlite_schema where type = 'table' and name not glob 'sqlite_*'";
    let tables: Vec<String> = sqlx::query_scalar(names).fetch_all(&pool).await.unwrap();
    for table in &tables {
        let columns = format!("select name from pragma_table_info('{table}') limit 1");
        let column: String = sqlx::query_scalar(AssertSqlSafe(columns)).fetch_one(&pool).await.unwrap();
        for (sql, allowed) in [
            (format!("update {table} set {column} = {column}"), UPDATED.contains(&table.as_str())),
            (format!("delete from {table}"), may_be_deleted(table)),
        ] {
            let mut changes = pool.begin().await.unwrap();
            let done = sqlx::query(AssertSqlSafe(sql.clone())).execute(&mut *changes).await;
            let refused =
                matches!(&done, Err(sqlx::Error::Database(error)) if error.code().as_deref() == Some(BY_TRIGGER));
            assert!(refused || allowed, "{sql}: {done:?}");
            changes.rollback().await.unwrap();
        }
    }
    assert!(tables.len() > 45, "{tables:?}");
}

#[tokio::test]
async fn newer_schema_is_refused_and_unchanged() {
    let (folder, service) = service().await;
    service.stop().await;
    let database = folder.path().join("a.db");
    let pool = intruder(&database).await;
    sqlx::query(
        "insert into _sqlx_migrations (version, description, success, checksum, execution_time) values (99, 'x', 1, x'00', 0)",
    )
    .execute(&pool)
    .await
    .unwrap();
    pool.close().await;
    let before = std::fs::read(&database).unwrap();
    let refused = Store::open(&database).await;
    assert!(matches!(refused, Err(StoreError::NewerSchema { found: 99, .. })), "{refused:?}");
    assert_eq!(std::fs::read(&database).unwrap(), before);
}

#[tokio::test]
async fn backup_of_a_running_service_is_complete_and_usable() {
    let (folder, service) = service().await;
    let study = service.study(|new| new.number_of_trials = 10).await;
    service.wait_for_trials(study, 3).await;
    let copy = folder.path().join("copy.db");
    backup::of_file(&folder.path().join("a.db"), &copy).await.unwrap();
    assert!(backup::of_store(&service.store, &copy).await.is_err(), "a copy is never overwritten");
    service.wait_for(study, &[StudyState::Finished]).await;
    let whole = service.trials(study).await;
    service.stop().await;

    let again = Service::start(&copy, Analytic::default(), 1).await;
    again.wait_for(study, &[StudyState::Finished]).await;
    let trials = again.trials(study).await;
    let actions = |trials: &[gaitwright_store::trials::Trial]| -> Vec<_> {
        trials.iter().map(|t| (t.action_index, t.gait_rmse_rad.map(f64::to_bits))).collect()
    };
    assert_eq!(actions(&trials), actions(&whole), "the copy goes on to the same trials");
    again.stop().await;
    std::fs::write(&copy, b"not a database at all").unwrap();
    assert!(read_only::check(&copy).await.is_err());
}
