//! Properties of requests: conditions, last received events, query strings, unreadable fields.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::extract::{ConnectInfo, Path};
use axum::http::{Request, StatusCode, Version, header};
use axum::middleware::map_request;
use axum::routing::{get, post};
use axum::{Json, Router};
use gaitwright_http::{Hosts, Proxies, ProxyHeaders, openapi, router, with_layers};
use gaitwright_service::access::Role;
use gaitwright_store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers;
use gaitwright_tests::service::{Answer, Service, for_localhost};
use http_body_util::BodyExt;
use serde_json::{Value, json};
use std::net::SocketAddr;
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
async fn change_with_an_outdated_revision_is_refused() {
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
async fn event_listener_with_an_unknown_last_id_receives_new_events() {
    let (_folder, service) = service().await;
    let study = service.study(|new| new.number_of_trials = 2).await;
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
    let extended = service.post(&format!("/api/v1/studies/{study}/extend"), &json!({"number_of_trials": 3})).await;
    assert_eq!(extended.status, StatusCode::OK);
    assert!(next().await.contains("event: study_changed"));
    let garbled = service.send(request("the last one")).await;
    assert_eq!(garbled.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert_eq!(garbled.json()["field"], "Last-Event-ID");
    service.stop().await;
}

#[tokio::test]
async fn field_of_the_wrong_type_is_refused_with_its_value_and_the_expected_type() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    for (path, body, field, value, allowed) in [
        (
            "studies",
            json!({"subject_id": subject, "number_of_trials": "x"}),
            "number_of_trials",
            json!("x"),
            "a whole number",
        ),
        ("studies", json!({"subject_id": subject, "seed": -1}), "seed", json!(-1), "a whole number of at least 0"),
        ("studies", json!({"subject_id": subject, "muscles": 3}), "muscles", json!(3), "true or false"),
        ("studies", json!({}), "subject_id", Value::Null, "present"),
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
fn description_of_rater_answers_matches_the_accepted_ones() {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let answer = &document["components"]["schemas"]["RaterAnswer"]["properties"]["answer"];
    let words = answer["enum"].as_array().unwrap();
    assert!(words.contains(&json!("cannot_tell")) && words.contains(&json!("unsafe_first")), "{words:?}");
}

/// Every refusal and failure is a problem document with the request identifier of the header.
fn is_complete_problem(answer: &Answer, status: u16, kind: &str) {
    assert_eq!(
        (answer.status.as_u16(), answer.content_type()),
        (status, "application/problem+json"),
        "{}",
        answer.text
    );
    let problem = answer.json();
    assert_eq!((&problem["type"], &problem["status"]), (&json!(kind), &json!(status)), "{problem}");
    assert_eq!(problem["request_id"], answer.headers["x-request-id"].to_str().unwrap(), "{problem}");
    assert!(!problem["title"].as_str().unwrap().is_empty() && !problem["detail"].as_str().unwrap().is_empty());
}

#[tokio::test]
async fn timeouts_panics_and_bare_statuses_are_problem_documents() {
    let (_folder, service) = service().await;
    let mut state = service.state();
    state.slowest_answer = Duration::from_millis(50);
    let slow = async || tokio::time::sleep(Duration::from_mins(10)).await;
    let panics = async || -> () { panic!("a handler that fails") };
    let routes = Router::new()
        .route("/api/slow", get(slow))
        .route("/api/panics", get(panics))
        .route("/panics", get(panics))
        .route("/api/bare/{status}", get(async |Path(status): Path<u16>| StatusCode::from_u16(status).unwrap()))
        .route("/api/rejected", post(async |Json(_): Json<Value>| ()));
    let router = with_layers(routes, state).layer(map_request(for_localhost));
    let send = async |request: Request<Body>| Answer::of(router.clone().oneshot(request).await.unwrap()).await;
    let fetch = |path: &str| send(Request::get(path).body(Body::empty()).unwrap());

    is_complete_problem(&fetch("/api/slow").await, 503, "/problems/timed-out");
    is_complete_problem(&fetch("/api/panics").await, 500, "/problems/internal");
    is_complete_problem(&fetch("/api/rejected").await, 405, "/problems/method-not-allowed");
    is_complete_problem(&fetch("/api/bare/x").await, 400, "/problems/malformed");
    for (status, kind) in [(404, "not-found"), (413, "too-large"), (418, "malformed"), (502, "internal")] {
        is_complete_problem(&fetch(&format!("/api/bare/{status}")).await, status, &format!("/problems/{kind}"));
    }
    let rejected = |kind: &'static str| {
        send(Request::post("/api/rejected").header(header::CONTENT_TYPE, kind).body(Body::from("{")).unwrap())
    };
    is_complete_problem(&rejected("text/plain").await, 415, "/problems/unsupported-media-type");
    is_complete_problem(&rejected("application/json").await, 400, "/problems/malformed");
    let page = fetch("/panics").await;
    let id = page.headers["x-request-id"].to_str().unwrap();
    assert!(page.status.as_u16() == 500 && page.text.contains("<h1>") && page.text.contains(id), "{}", page.text);
    service.stop().await;
}

#[tokio::test]
async fn refusals_have_request_identifiers_and_problem_types_have_pages() {
    let (_folder, service) = service().await;
    for (answer, status, kind) in [
        (service.fetch("/api/v1/nothing").await, 404, "/problems/not-found"),
        (service.fetch("/static/%ff").await, 400, "/problems/malformed"),
        (service.post("/health", &json!({})).await, 405, "/problems/method-not-allowed"),
        (service.post_text("/api/v1/subjects", "text/plain", "{}").await, 415, "/problems/unsupported-media-type"),
        (service.post_text("/api/v1/subjects", "application/json", "{").await, 400, "/problems/malformed"),
        (
            service.post_text("/api/v1/subjects", "application/json", &"x".repeat(2 << 20)).await,
            413,
            "/problems/too-large",
        ),
    ] {
        is_complete_problem(&answer, status, kind);
        let page = service.fetch(kind).await;
        assert!(page.status == StatusCode::OK && page.text.contains(kind), "{kind}: {}", page.text);
    }
    assert_ne!(
        service.fetch("/health").await.headers["x-request-id"],
        service.fetch("/health").await.headers["x-request-id"]
    );
    let all = service.fetch("/problems").await.text;
    let listed: Vec<&str> =
        all.split("href=\"/problems/").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert!(listed.len() > 12, "{listed:?}");
    for name in listed {
        let page = service.fetch(&format!("/problems/{name}")).await;
        assert!(page.status == StatusCode::OK && page.text.contains("HTTP status"), "{name}");
    }
    assert_eq!(service.fetch("/problems/nothing").await.status, StatusCode::NOT_FOUND);
    service.stop().await;
}

#[tokio::test]
async fn request_without_exactly_one_host_is_refused() {
    let (_folder, service) = service().await;
    let router = router(service.state());
    let status = async |hosts: &[&str], version: Version, uri: &str| {
        let mut request = Request::get(uri).version(version);
        for host in hosts {
            request = request.header(header::HOST, *host);
        }
        router.clone().oneshot(request.body(Body::empty()).unwrap()).await.unwrap().status().as_u16()
    };
    let (path, new, old) = ("/health", Version::HTTP_11, Version::HTTP_10);
    assert_eq!(status(&["localhost"], new, path).await, 200);
    assert_eq!(status(&[], old, path).await, 200);
    assert_eq!(status(&[], new, path).await, 400);
    assert_eq!(status(&["localhost", "localhost"], new, path).await, 400);
    assert_eq!(status(&["localhost", "evil.example"], old, path).await, 400);
    assert_eq!(status(&["evil.example"], old, path).await, 403);
    assert_eq!(status(&["localhost"], new, "http://evil.example/health").await, 400);
    assert_eq!(status(&["localhost"], new, "http://localhost/health").await, 200);
    service.stop().await;
}

#[tokio::test]
async fn request_with_two_idempotency_keys_is_refused() {
    let (_folder, service) = service().await;
    let body = json!({"pseudonym": "S1", "height_m": 1.8, "body_mass_kg": 70}).to_string();
    let request = Request::post("/api/v1/subjects").header(header::CONTENT_TYPE, "application/json");
    let request = request.header("idempotency-key", "one").header("idempotency-key", "two");
    let refused = service.send(request.body(Body::from(body)).unwrap()).await;
    assert_eq!(refused.status, StatusCode::BAD_REQUEST, "{}", refused.text);
    assert!(refused.text.contains("occurs more than once"), "{}", refused.text);
    service.stop().await;
}

/// A service that trusts a proxy on this machine and accepts one host name.
async fn behind_a_proxy() -> (TempDir, Service, Router) {
    let (folder, service) = callers::service().await;
    let mut state = service.state();
    state.hosts = Hosts::new(([127, 0, 0, 1], 0).into(), &["gait.example".to_owned()]);
    state.proxies = Proxies::new(&["127.0.0.1".parse().unwrap()], ProxyHeaders::XForwarded);
    (folder, service, router(state))
}

/// A request from an address.
fn from(peer: &str, method: &str, path: &str, headers: &[(&str, &str)]) -> Request<Body> {
    let mut request = Request::builder().method(method).uri(path);
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    let peer: SocketAddr = peer.parse().unwrap();
    request.extension(ConnectInfo(peer)).body(Body::empty()).unwrap()
}

const PROXY: &str = "127.0.0.1:50000";
const STRANGER: &str = "192.0.2.7:50000";

#[tokio::test]
async fn cookies_and_origins_follow_the_headers_of_a_trusted_proxy() {
    let (_folder, service, router) = behind_a_proxy().await;
    let (_, link) = callers::user(&service, "Ada", Role::Administrator).await;
    let send = async |request: Request<Body>| Answer::of(router.clone().oneshot(request).await.unwrap()).await;
    let forwarded = [
        ("host", "127.0.0.1:8080"),
        ("x-forwarded-for", "192.0.2.9"),
        ("x-forwarded-proto", "https"),
        ("x-forwarded-host", "gait.example"),
    ];
    let with = |more: &[(&'static str, &'static str)]| [&forwarded[..], more].concat();
    let path = format!("/sign-in/{link}");
    let signed_in = send(from(PROXY, "POST", &path, &with(&[("origin", "https://gait.example")]))).await;
    assert_eq!(signed_in.status, StatusCode::SEE_OTHER, "{}", signed_in.text);
    assert!(signed_in.headers["set-cookie"].to_str().unwrap().ends_with("; Secure"), "{:?}", signed_in.headers);
    assert!(signed_in.headers.contains_key("strict-transport-security"));
    // The browser is at the forwarded origin: that of the proxy's own connection is another one.
    for (origin, allowed) in [
        ("https://gait.example", true),
        ("http://gait.example", false),
        ("http://127.0.0.1:8080", false),
        ("https://evil.example", false),
    ] {
        let answer = send(from(PROXY, "POST", "/sign-out", &with(&[("origin", origin)]))).await;
        assert_eq!(answer.status != StatusCode::FORBIDDEN, allowed, "{origin}");
    }
    let plain = send(from(PROXY, "GET", "/health", &[("host", "localhost")])).await;
    assert!(plain.status.is_success() && !plain.headers.contains_key("strict-transport-security"));
    service.stop().await;
}

#[tokio::test]
async fn forwarded_headers_of_untrusted_proxies_are_ignored() {
    let (_folder, service, router) = behind_a_proxy().await;
    let send = async |request: Request<Body>| Answer::of(router.clone().oneshot(request).await.unwrap()).await;
    let lie = [("host", "gait.example"), ("x-forwarded-proto", "https"), ("x-forwarded-for", "127.0.0.1")];
    let answer = send(from(STRANGER, "GET", "/health", &lie)).await;
    assert!(answer.status.is_success() && !answer.headers.contains_key("strict-transport-security"));
    let host = [("host", "evil.example"), ("x-forwarded-host", "gait.example")];
    assert_eq!(send(from(STRANGER, "GET", "/health", &host)).await.status, StatusCode::FORBIDDEN);
    assert_eq!(send(from(PROXY, "GET", "/health", &host)).await.status, StatusCode::OK);
    let garbled = [("host", "gait.example"), ("x-forwarded-for", "somebody")];
    is_complete_problem(&send(from(PROXY, "GET", "/health", &garbled)).await, 400, "/problems/malformed");
    service.stop().await;
}

#[tokio::test]
async fn service_without_sign_in_refuses_forwarded_requests() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let host = ("host", "localhost");
    assert_eq!(service.send(from(PROXY, "GET", "/api/v1/studies", &[host])).await.status, StatusCode::OK);
    for header in [
        ("x-forwarded-for", "192.0.2.9"),
        ("x-forwarded-proto", "https"),
        ("x-forwarded-host", "gait.example"),
        ("x-real-ip", "192.0.2.9"),
        ("forwarded", "for=192.0.2.9"),
        ("via", "1.1 proxy"),
    ] {
        for path in ["/api/v1/studies", "/"] {
            let refused = service.send(from(PROXY, "GET", path, &[host, header])).await;
            assert_eq!(refused.status, StatusCode::FORBIDDEN, "{header:?}");
            assert!(refused.text.contains("without sign-in"), "{}", refused.text);
        }
    }
    service.stop().await;
}

#[tokio::test]
async fn missing_body_replaces_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let muscles = format!("/api/v1/subjects/{}/muscles", service.subject().await);
    let measured = service.put(&muscles, &json!({"sol": {"max_force_n": 4200.0}})).await;
    assert_eq!(measured.status, StatusCode::OK, "{}", measured.text);
    let request = Request::builder().method("PUT").uri(&muscles).body(Body::empty()).unwrap();
    let refused = service.send(request).await;
    assert_eq!(refused.status, StatusCode::BAD_REQUEST, "{}", refused.text);
    assert_eq!(service.fetch(&muscles).await.json()["sol"]["max_force_n"], 4200.0);
    service.stop().await;
}

#[tokio::test]
async fn searches_and_keys_are_accepted_if_and_only_if_they_match_the_description() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    for list in ["audit", "access-log"] {
        let search = async |text: &str| service.fetch(&format!("/api/v1/{list}?text={text}")).await.status;
        assert_eq!(search(&"x".repeat(200)).await, StatusCode::OK);
        assert_eq!(search(&"x".repeat(201)).await, StatusCode::UNPROCESSABLE_ENTITY);
    }
    let subject = json!({"pseudonym": "S", "height_m": 1.7, "body_mass_kg": 60.0}).to_string();
    for (key, status) in [("a b", StatusCode::CREATED), ("a\tb", StatusCode::BAD_REQUEST)] {
        let request =
            Request::builder().method("POST").uri("/api/v1/subjects").header("content-type", "application/json");
        let sent =
            service.send(request.header("idempotency-key", key).body(Body::from(subject.clone())).unwrap()).await;
        assert_eq!(sent.status, status, "{key:?}: {}", sent.text);
    }
    service.stop().await;
}
