//! Expired data is deleted, and nothing else.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, header};
use gaitwright_service::expired_data::{DeletedCounts, delete_expired};
use gaitwright_store::audit;
use gaitwright_store::seals::{self, SealCheck};
use gaitwright_store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;

const TABLES: &str = "select name from sqlite_master where type = 'table' and name not glob 'sqlite_*'";

async fn counts(service: &Service) -> Vec<(String, i64)> {
    let mut reader = service.store.read().await.unwrap();
    let tables: Vec<String> = sqlx::query_scalar(TABLES).fetch_all(&mut **reader).await.unwrap();
    let mut counts = Vec::new();
    for table in tables {
        let sql = sqlx::AssertSqlSafe(format!("select count(*) from {table}"));
        counts.push((table, sqlx::query_scalar(sql).fetch_one(&mut **reader).await.unwrap()));
    }
    counts
}

#[tokio::test]
async fn only_expired_keys_sessions_and_links_are_deleted() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let body = r#"{"pseudonym": "S1", "height_m": 1.7, "body_mass_kg": 65}"#;
    for key in ["old", "new"] {
        let body = body.replace("S1", key);
        let request = Request::post("/api/v1/subjects")
            .header(header::CONTENT_TYPE, "application/json")
            .header("idempotency-key", key);
        let done = service.send(request.body(Body::from(body)).unwrap()).await;
        assert!(done.status.is_success(), "{}", done.text);
    }
    let mut writer = service.store.write().await.unwrap();
    let (old, new) = ("2020-01-01T00:00:00.000Z", "2999-01-01T00:00:00.000Z");
    let user = "insert into users (id, name, role, created_at) values ('u', 'U', 'rater', ?)";
    sqlx::query(user).bind(old).execute(&mut **writer).await.unwrap();
    sqlx::query("update idempotency_keys set created_at = ? where key = 'old'")
        .bind(old)
        .execute(&mut **writer)
        .await
        .unwrap();
    for (hash, seen, ended) in [("a", old, None), ("b", new, Some(old)), ("c", new, None)] {
        sqlx::query(
            "insert into sessions (hash, id, user_id, created_at, seen_at, ended_at) values (?1, ?1, 'u', ?2, ?3, ?4)",
        )
        .bind(hash.repeat(64))
        .bind(old)
        .bind(seen)
        .bind(ended)
        .execute(&mut **writer)
        .await
        .unwrap();
    }
    for (hash, expires, used) in [("a", old, None), ("b", new, Some(old)), ("c", new, None)] {
        sqlx::query(
            "insert into sign_in_links (hash, user_id, created_at, expires_at, used_at) values (?, 'u', ?, ?, ?)",
        )
        .bind(hash.repeat(64))
        .bind(old)
        .bind(expires)
        .bind(used)
        .execute(&mut **writer)
        .await
        .unwrap();
    }
    gaitwright_store::commit(writer).await.unwrap();

    let before = counts(&service).await;
    let dropped = delete_expired(&service.store).await.unwrap();
    assert_eq!(dropped, DeletedCounts { answers: 1, sessions: 2, links: 2 });
    for ((table, before), (_, after)) in before.into_iter().zip(counts(&service).await) {
        let expected = match table.as_str() {
            "idempotency_keys" => 1,
            "sessions" | "sign_in_links" => 2,
            // One row of every kind that is deleted.
            "checksums" => 5,
            _ => 0,
        };
        assert_eq!(before - after, expected, "{table}");
    }
    assert_eq!(delete_expired(&service.store).await.unwrap(), DeletedCounts::default());
    let mut reader = service.store.read().await.unwrap();
    assert!(matches!(seals::verify(&mut reader).await.unwrap(), SealCheck::Intact { .. }));
    assert!(matches!(audit::verify(&mut reader).await.unwrap(), audit::ChainCheck::Intact { .. }));
    drop(reader);
    service.stop().await;
}
