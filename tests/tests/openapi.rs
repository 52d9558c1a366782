//! The description of the REST interface: complete, committed, and what the service really does.
//!
//! `GAITWRIGHT_WRITE_OPENAPI=1 cargo test -p gaitwright-tests --test openapi` writes the committed file anew.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright::http::openapi;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::Value;
use std::path::Path;

#[test]
fn the_committed_description_is_that_of_the_code() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../server/openapi.json");
    let text = openapi::text().unwrap();
    if std::env::var_os("GAITWRIGHT_WRITE_OPENAPI").is_some() {
        std::fs::write(&file, &text).unwrap();
    }
    let committed = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(committed == text, "server/openapi.json is not up to date: `cargo run -- openapi > server/openapi.json`");
}

#[test]
fn every_operation_says_what_it_needs_takes_and_answers() {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    assert!(document["openapi"].as_str().unwrap().starts_with("3.1"));
    let mut operations = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            operations += 1;
            let what = format!("{method} {path}");
            assert!(operation["summary"].as_str().is_some_and(|s| !s.is_empty()), "{what} has no summary");
            assert!(operation["security"].is_array() || path.ends_with("/health"), "{what} asks for no right");
            let named: Vec<&str> = operation["parameters"]
                .as_array()
                .into_iter()
                .flatten()
                .filter(|p| p["in"] == "path")
                .map(|p| p["name"].as_str().unwrap())
                .collect();
            let expected: Vec<&str> =
                path.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}')).collect();
            assert_eq!(named, expected, "{what}");
            if method != "get" {
                let key = |p: &Value| p["name"] == "Idempotency-Key";
                assert!(operation["parameters"].as_array().unwrap().iter().any(key), "{what}");
            }
        }
    }
    assert!(operations > 30, "{operations}");
    // Every reference leads somewhere.
    let text = document.to_string();
    for reference in text.split("\"$ref\":\"#/components/schemas/").skip(1) {
        let name = reference.split('"').next().unwrap();
        assert!(document["components"]["schemas"][name].is_object(), "{name}");
    }
}

#[tokio::test]
async fn the_description_is_served_and_its_page_needs_nothing_from_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let served = service.fetch("/api/openapi.json").await;
    assert_eq!((served.status, served.text), (StatusCode::OK, openapi::text().unwrap()));
    let page = service.fetch("/api").await;
    assert_eq!(page.status, StatusCode::OK);
    assert!(page.text.contains("/api/v1/studies/{id}/preferences"));
    for elsewhere in ["http://", "https://", "//cdn"] {
        assert!(!page.text.contains(elsewhere), "{elsewhere}");
    }
    service.stop().await;
}
