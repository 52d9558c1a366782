//! What a request says of itself: conditions, events that were seen, query strings, fields that cannot be read.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, StatusCode, header};
use gaitwright::http::openapi;
use gaitwright::store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::{Answer, Service};
use http_body_util::BodyExt;
use serde_json::{Value, json};
use std::time::Duration;
use tempfile::TempDir;
use tower::ServiceExt;

async fn service() -> (TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    (folder, service)
}

async fn rename(service: &Service, path: &str, if_match: &[&str]) -> Answer {
    let mut request = Request::patch(path).header(header::CONTENT_TYPE, "application/json");
    for line in if_match {
        request = request.header(header::IF_MATCH, *line);
    }
    service.send(request.body(Body::from(r#"{"name": "another"}"#)).unwrap()).await
}

#[tokio::test]
async fn a_change_is_made_from_one_of_the_revisions_that_it_names_or_not_at_all() {
    let (_folder, service) = service().await;
    let study = service.study(|new| new.start = false).await;
    let path = format!("/api/v1/studies/{study}");
    let tag = || async {
        let answer = service.fetch(&path).await;
        answer.headers.get(header::ETAG).unwrap().to_str().unwrap().to_owned()
    };
    let first = tag().await;
    let listed = format!("\"stale\", {first}");
    assert_eq!(rename(&service, &path, &[&listed]).await.status, StatusCode::OK);
    let second = tag().await;
    assert_ne!(first, second);
    assert_eq!(rename(&service, &path, &["\"stale\"", &second]).await.status, StatusCode::OK, "two lines are a list");
    assert_eq!(rename(&service, &path, &["*"]).await.status, StatusCode::OK);
    let present = tag().await;
    for stale in [first, second, format!("W/{present}"), "\"\"".to_owned(), "nonsense".to_owned(), String::new()] {
        let refused = rename(&service, &path, &[&stale]).await;
        assert_eq!(refused.status, StatusCode::PRECONDITION_FAILED, "{stale}: {}", refused.text);
        assert_eq!(refused.json()["type"], "/problems/changed");
    }
    assert_eq!(tag().await, present);
    service.stop().await;
}

#[tokio::test]
async fn who_saw_events_of_a_record_that_is_no_more_hears_of_the_next_one() {
    let (_folder, service) = service().await;
    let study = service.study(|new| new.trial_budget = 2).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let request = |seen: &str| {
        let path = format!("/api/v1/studies/{study}/events");
        Request::get(path).header("last-event-id", seen).body(Body::empty()).unwrap()
    };
    let mut stream = service.router().oneshot(request("99999")).await.unwrap().into_body();
    let mut next = async || {
        let frame = tokio::time::timeout(Duration::from_secs(20), stream.frame()).await.unwrap().unwrap().unwrap();
        String::from_utf8(frame.into_data().unwrap().to_vec()).unwrap()
    };
    assert!(next().await.contains("event: study_state"));
    let extended = service.post(&format!("/api/v1/studies/{study}/extend"), &json!({"trial_budget": 3})).await;
    assert_eq!(extended.status, StatusCode::OK);
    assert!(next().await.contains("event: study_changed"));
    let garbled = service.send(request("the last one")).await;
    assert_eq!(garbled.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert_eq!(garbled.json()["field"], "Last-Event-ID");
    service.stop().await;
}

#[tokio::test]
async fn a_parameter_that_no_list_knows_is_refused() {
    let (_folder, service) = service().await;
    let study = service.study(|new| new.start = false).await;
    let of_study = format!("studies/{study}");
    for path in ["studies", "subjects", "audit", &format!("{of_study}/trials"), &format!("{of_study}/preferences")] {
        let refused = service.fetch(&format!("/api/v1/{path}?limt=5")).await;
        assert_eq!(refused.status, StatusCode::BAD_REQUEST, "{path}");
        assert!(refused.text.contains("limt"), "{}", refused.text);
    }
    service.stop().await;
}

#[tokio::test]
async fn a_field_of_the_wrong_type_is_named_with_its_value_and_what_would_be_read() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    for (path, body, field, value, allowed) in [
        ("studies", json!({"subject_id": subject, "trial_budget": "x"}), "trial_budget", json!("x"), "a whole number"),
        ("studies", json!({"subject_id": subject, "seed": -1}), "seed", json!(-1), "a whole number, 0 or more"),
        ("studies", json!({"subject_id": subject, "muscles": 3}), "muscles", json!(3), "true or false"),
        ("studies", json!({}), "subject_id", Value::Null, "it must be there"),
        ("subjects", json!({"pseudonym": "S", "height_m": "1.7"}), "height_m", json!("1.7"), "a number"),
    ] {
        let refused = service.post(&format!("/api/v1/{path}"), &body).await;
        assert_eq!(refused.status, StatusCode::BAD_REQUEST, "{}", refused.text);
        let problem = refused.json();
        assert_eq!((&problem["field"], &problem["value"]), (&json!(field), &value), "{problem}");
        assert!(problem["allowed"].as_str().unwrap().starts_with(allowed), "{problem}");
    }
    service.stop().await;
}

#[test]
fn the_answers_of_raters_are_described_as_they_are_taken() {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let answer = &document["components"]["schemas"]["RaterAnswer"]["properties"]["answer"]["$ref"];
    let name = answer.as_str().unwrap().rsplit('/').next().unwrap();
    let words = document["components"]["schemas"][name]["enum"].as_array().unwrap();
    assert!(words.contains(&json!("cannot_tell")) && words.contains(&json!("unsafe_first")), "{words:?}");
}
