//! Arbitrary bytes from outside, as bodies, forms, headers, cursors and archives, are read or refused, and never make
//! the program fail.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{HeaderValue, Method, Request, StatusCode};
use gaitwright_http::{AccessState, openapi};
use gaitwright_service::studies::archive::archive_file::read_through;
use gaitwright_store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::archives::exported;
use gaitwright_tests::service::Service;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use serde_json::Value;
use std::sync::Arc;
use tower::ServiceExt;

/// Requests of each kind.
const CASES: usize = 80;

/// A service with a finished study.
struct Target {
    service: Service,
    study: String,
    trial: String,
    _folder: tempfile::TempDir,
}

impl Target {
    async fn set() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
        let study = service.study(|new| new.number_of_trials = 3).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let trial = service.trials(study).await[0].id.to_string();
        Self { service, study: study.to_string(), trial, _folder: folder }
    }

    /// Sends a request and requires that the program does not fail.
    async fn survives(&self, request: Request<Body>, what: &str) {
        let shown = format!("{what}: {} {}", request.method(), request.uri());
        let answer = self.service.send(request).await;
        assert!(answer.status.as_u16() < 500, "{shown}: {} {}", answer.status, answer.text);
    }

    /// The same without the body, which of a stream has no end. Whether somebody was there to do it.
    async fn answers(&self, request: Request<Body>, what: &str) -> bool {
        let shown = format!("{what}: {} {}", request.method(), request.uri());
        let status = self.service.router().oneshot(request).await.unwrap().status();
        assert!(status.as_u16() < 500, "{shown}: {status}");
        status != StatusCode::UNAUTHORIZED
    }

    fn path(&self, template: &str) -> String {
        let id = if template.starts_with("/api/v1/trials") { &self.trial } else { &self.study };
        template.replace("{id}", id).replace("{code}", &"a".repeat(64))
    }
}

/// JSON of any shape, with the words of this service among its names and values.
fn any_json() -> impl Strategy<Value = Value> {
    let word = prop_oneof![
        prop::sample::select(vec![
            "subject_id",
            "trial_a",
            "trial_b",
            "answer",
            "seed",
            "number_of_trials",
            "search_space",
            "dimensions",
            "name",
            "values",
            "lengthscale",
            "reason",
            "label",
            "gait_rmse_rad",
            "learner",
            "height_m",
            "a",
            "converged",
        ])
        .prop_map(str::to_owned),
        "\\PC{0,12}",
    ];
    let leaf = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        any::<i64>().prop_map(Value::from),
        any::<f64>().prop_map(Value::from),
        word.clone().prop_map(Value::from),
    ];
    leaf.prop_recursive(4, 24, 6, move |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..4).prop_map(Value::from),
            prop::collection::btree_map(word.clone(), inner, 0..6)
                .prop_map(|map| Value::Object(map.into_iter().collect())),
        ]
    })
}

/// Pseudo-random draws, the same in every run.
fn drawn<S: Strategy>(strategy: &S) -> Vec<S::Value> {
    let mut runner = TestRunner::deterministic();
    (0..CASES).map(|_| strategy.new_tree(&mut runner).unwrap().current()).collect()
}

/// Every operation of the description that takes a body.
fn operations() -> Vec<(Method, String)> {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut found = Vec::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        for method in item.as_object().unwrap().keys().filter(|method| *method != "get") {
            found.push((method.to_uppercase().parse().unwrap(), path.clone()));
        }
    }
    found
}

#[tokio::test]
async fn malformed_bodies_are_refused_without_server_errors() {
    let target = Target::set().await;
    let operations = operations();
    let bytes = prop::collection::vec(any::<u8>(), 0..120);
    for (number, (json, bytes)) in drawn(&(any_json(), bytes)).into_iter().enumerate() {
        for (method, path) in &operations {
            // Each operation gets every eleventh draw.
            if (number + path.len()) % 11 != 0 {
                continue;
            }
            for body in [json.to_string().into_bytes(), bytes.clone()] {
                let request = Request::builder()
                    .method(method.clone())
                    .uri(target.path(path))
                    .header("content-type", "application/json")
                    .body(Body::from(body))
                    .unwrap();
                target.survives(request, &json.to_string()).await;
            }
        }
    }
    target.service.stop().await;
}

#[tokio::test]
async fn malformed_forms_are_refused_without_server_errors() {
    let target = Target::set().await;
    let study = &target.study;
    let paths = [
        "/studies/new".to_owned(),
        format!("/studies/{study}/do"),
        format!("/studies/{study}/compare"),
        format!("/studies/{study}/retract"),
        format!("/studies/{study}/undo"),
        "/sign-in".to_owned(),
        "/account".to_owned(),
    ];
    let names = [
        "button",
        "saved",
        "transition",
        "a",
        "b",
        "answer",
        "source",
        "author",
        "key",
        "note",
        "name",
        "password",
        "subject",
        "seed",
    ];
    let field =
        (prop::sample::select(names.to_vec()), "\\PC{0,20}").prop_map(|(name, value)| format!("{name}={value}"));
    let text = prop_oneof![
        prop::collection::vec(field, 0..6).prop_map(|fields| fields.join("&").into_bytes()),
        prop::collection::vec(any::<u8>(), 0..80),
    ];
    for (number, body) in drawn(&text).into_iter().enumerate() {
        let request = Request::post(&paths[number % paths.len()])
            .header("content-type", "application/x-www-form-urlencoded")
            .body(Body::from(body.clone()))
            .unwrap();
        target.survives(request, &String::from_utf8_lossy(&body)).await;
    }
    target.service.stop().await;
}

#[tokio::test]
async fn malformed_headers_are_refused_without_server_errors() {
    let mut target = Target::set().await;
    let trials = format!("/api/v1/studies/{}/trials", target.study);
    let post = "/api/v1/subjects";
    let names = [
        "cookie",
        "authorization",
        "host",
        "last-event-id",
        "idempotency-key",
        "if-match",
        "accept",
        "origin",
        "sec-fetch-site",
        "content-type",
        "content-length",
    ];
    let starts = ["", "gaitwright_session=", "Bearer ", "127.0.0.1:", "W/\"", "\""];
    // What a header can hold: others never come as far as a handler.
    let byte = prop_oneof![0x20_u8..0x7f, 0x80_u8..=0xff];
    let value = (prop::sample::select(starts.to_vec()), prop::collection::vec(byte, 0..40));
    let (starting, events) =
        (format!("/api/v1/studies/{}/start", target.study), format!("/api/v1/studies/{}/events", target.study));
    let mut reached = 0;
    for (name, (start, rest)) in drawn(&(prop::sample::select(names.to_vec()), value)) {
        let bytes: Vec<u8> = start.bytes().chain(rest).collect();
        let value = HeaderValue::from_bytes(&bytes).unwrap();
        // Where nobody needs to sign in, a request comes as far as the handlers that read the other headers.
        for access in [AccessState::by_sign_in(900.0), AccessState::without_sign_in()] {
            target.service.access = Arc::new(access);
            for request in [Request::get(&trials), Request::post(post), Request::post(&starting), Request::get(&events)]
            {
                let other = if name == "content-type" { "accept" } else { "content-type" };
                let request = request.header(name, value.clone()).header(other, "application/json");
                reached += usize::from(target.answers(request.body(Body::from("{}")).unwrap(), name).await);
            }
        }
    }
    assert!(reached >= 4 * CASES, "{reached}");
    target.service.stop().await;
}

#[tokio::test]
async fn malformed_cursors_and_identifiers_are_refused_without_server_errors() {
    let target = Target::set().await;
    let study = &target.study;
    let paths = [
        format!("/api/v1/studies/{study}/trials?cursor="),
        format!("/api/v1/studies/{study}/preferences?cursor="),
        "/api/v1/studies?cursor=".to_owned(),
        "/api/v1/subjects?cursor=".to_owned(),
        "/api/v1/audit?cursor=".to_owned(),
        "/api/v1/subjects?limit=".to_owned(),
        "/api/v1/study-comparison?ids=".to_owned(),
        "/api/v1/trials/".to_owned(),
        "/studies/".to_owned(),
        "/static/".to_owned(),
        "/sign-in/".to_owned(),
    ];
    let text = prop_oneof![
        any::<i64>().prop_map(|number| number.to_string()),
        any::<u64>().prop_map(|number| number.to_string()),
        "[a-f0-9-]{36}",
        "[!-~]{0,30}",
        prop::collection::vec(any::<u8>(), 0..12).prop_map(|bytes| bytes
            .iter()
            .map(|byte| format!("%{byte:02x}"))
            .collect::<Vec<_>>()
            .concat()),
    ];
    for text in drawn(&text) {
        for path in &paths {
            if let Ok(request) = Request::get(format!("{path}{text}")).body(Body::empty()) {
                target.survives(request, &text).await;
            }
        }
    }
    target.service.stop().await;
}

#[tokio::test]
async fn malformed_archives_are_refused_without_server_errors() {
    let target = Target::set().await;
    let study = target.study.parse().unwrap();
    let whole = exported(&target.service.store, study).await;
    for (at, flip, bytes) in drawn(&(any::<prop::sample::Index>(), 1_u8.., prop::collection::vec(any::<u8>(), 0..200)))
    {
        assert!(read_through(&bytes[..]).is_err());
        let mut changed = whole.clone();
        let place = at.index(changed.len());
        changed[place] ^= flip;
        assert!(read_through(&changed[..]).is_err(), "byte {place}");
        assert!(read_through(&whole[..place]).is_err());
    }
    assert!(read_through(&whole[..]).is_ok());
    target.service.stop().await;
}
