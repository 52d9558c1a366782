//! Signing in: back-off, passwords, sessions and their end, roles, and disabling of users.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Method, Request, StatusCode, header};
use futures_util::{StreamExt, stream};
use gaitwright_http::AccessState;
use gaitwright_service::access::back_off::{self, AttemptOrigin};
use gaitwright_service::access::session::SessionLimits;
use gaitwright_service::access::sign_in;
use gaitwright_service::access::tokens::{self as making, NewToken};
use gaitwright_service::access::user_administration::{self, NewUser};
use gaitwright_service::access::{Caller, Clock, Right, Role};
use gaitwright_store::audit::{self, Actor, AuditRow};
use gaitwright_store::members::MemberKind;
use gaitwright_store::{Instant, Store, UserId, commit, now, sign_in_failures};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers::{
    self, As, FORM, cookie_of, member, send, service, session_of, sign_in_from, signed_in, token, user, with_password,
};
use gaitwright_tests::service::{Answer, Service};
use gaitwright_tests::sources;
use serde_json::{Value, json};
use std::net::Ipv6Addr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;
use tokio::sync::oneshot;
use tower::ServiceExt;

const RIGHT: &str = "correct horse battery";
const ME: &str = "/api/v1/me";
const JSON: &str = "application/json";
const OWNER: [u8; 4] = [10, 0, 0, 1];
const ATTACKER: [u8; 4] = [192, 0, 2, 66];

async fn status(service: &Service, who: &As) -> StatusCode {
    send(service, who, &Method::GET, ME, "", "").await.status
}

async fn post(service: &Service, who: &As, path: &str, body: &Value) -> (StatusCode, Value) {
    change(service, who, &Method::POST, path, body).await
}

async fn put(service: &Service, who: &As, path: &str, body: &Value) -> (StatusCode, Value) {
    change(service, who, &Method::PUT, path, body).await
}

async fn change(service: &Service, who: &As, method: &Method, path: &str, body: &Value) -> (StatusCode, Value) {
    let answer = send(service, who, method, path, JSON, &body.to_string()).await;
    (answer.status, serde_json::from_str(&answer.text).unwrap_or_default())
}

/// A service on the record of a stopped one, as soon as that one has released the record.
async fn start_anew(database: &Path) -> Service {
    for _ in 0..500 {
        if Store::open(database).await.is_ok() {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    Service::start(database, Analytic::default(), 1).await
}

async fn trail(service: &Service, change: &str) -> Vec<AuditRow> {
    let rows = audit::page(&mut service.store.read().await.unwrap(), "", None, 1000).await.unwrap();
    rows.into_iter().filter(|row| row.change == change).collect()
}

/// Attempts that were started and never finished, as when the client disconnects.
async fn abort_attempts(service: &Service, network: &str, names: impl Iterator<Item = String>) {
    let mut writer = service.store.write().await.unwrap();
    let at = now();
    for name in names {
        let origin = AttemptOrigin { network: network.to_owned(), site: None, known: None };
        let _ = back_off::begin(&mut writer, at, &name, origin).await.unwrap();
    }
    commit(writer).await.unwrap();
}

/// Sign-in with a stopped clock, so that no wait ends before the next attempt, however slow the machine is.
fn standing_still() -> Arc<AccessState> {
    standing_at(now())
}

fn standing_at(at: Instant) -> Arc<AccessState> {
    Arc::new(AccessState { clock: Clock::over(move || at), ..AccessState::by_sign_in(3600.0) })
}

#[tokio::test]
async fn bodies_of_anonymous_callers_are_limited_in_size() {
    let (_folder, mut service) = service().await;
    service.access = Arc::new(AccessState::by_sign_in(3600.0));
    let token = token(&service, &[Right::Run]).await;
    let name = |length: usize| format!("name={}&password={RIGHT}", "a".repeat(length));
    for (length, expected) in [(60_000, StatusCode::UNAUTHORIZED), (70_000, StatusCode::PAYLOAD_TOO_LARGE)] {
        let answer = send(&service, &As::Nobody, &Method::POST, "/sign-in", FORM, &name(length)).await;
        assert_eq!(answer.status, expected, "{length}: {}", answer.text);
    }
    let long = json!({"name": "a".repeat(70_000)});
    let (refused, problem) = post(&service, &token, "/api/v1/studies", &long).await;
    assert_eq!((refused, &problem["field"]), (StatusCode::BAD_REQUEST, &json!("subject_id")), "it was read");
    service.stop().await;
}

/// Sends a change whose body is complete only after something else has happened.
async fn with_late_body(
    service: &Service,
    (who, method, path): (&As, Method, &str),
    body: &Value,
    meanwhile: impl Future<Output = ()>,
) -> Answer {
    let (complete, completed) = oneshot::channel::<()>();
    let text = body.to_string();
    let (first, rest) = (text[..1].to_owned(), text[1..].to_owned());
    let rest = async move {
        completed.await.unwrap();
        Ok::<_, std::io::Error>(rest)
    };
    let body = Body::from_stream(stream::iter([Ok(first)]).chain(stream::once(rest)));
    let request = callers::of(who, Request::builder().method(method).uri(path)).header(header::CONTENT_TYPE, JSON);
    let finish = async {
        tokio::time::sleep(Duration::from_millis(300)).await;
        meanwhile.await;
        complete.send(()).unwrap();
    };
    tokio::join!(service.send(request.body(body).unwrap()), finish).0
}

#[tokio::test]
async fn change_is_refused_if_rights_or_consent_end_before_its_body_is_complete() {
    let (_folder, mut service) = service().await;
    service.access = Arc::new(AccessState::by_sign_in(3600.0));
    let root = signed_in(&service, Role::Administrator).await;
    let study = service.study(|new| (new.number_of_trials, new.start) = (2, false)).await;
    let (id, link) = user(&service, "Eve", Role::Administrator).await;
    let mut writer = service.store.write().await.unwrap();
    let (_, session) = sign_in::with_link(&mut writer, &link).await.unwrap();
    commit(writer).await.unwrap();
    let eve = As::Session(session);
    let disable = async {
        assert_eq!(post(&service, &root, &format!("/api/v1/users/{id}/disable"), &json!({})).await.0, StatusCode::OK);
    };
    let token = json!({"name": "mine", "scopes": ["read"]});
    let refused = with_late_body(&service, (&eve, Method::POST, "/api/v1/tokens"), &token, disable).await;
    assert_eq!(refused.status, StatusCode::UNAUTHORIZED, "{}", refused.text);

    let withdraw = async {
        let path = format!("/api/v1/subjects/{}/withdraw", service.subject().await);
        assert_eq!(post(&service, &root, &path, &json!({"reason": "asked to"})).await.0, StatusCode::OK);
    };
    let (path, name) = (format!("/api/v1/studies/{study}"), json!({"name": "late"}));
    let refused = with_late_body(&service, (&root, Method::PATCH, &path), &name, withdraw).await;
    assert_eq!(refused.status, StatusCode::CONFLICT, "{}", refused.text);
    service.stop().await;
}

#[tokio::test]
async fn right_password_is_accepted_while_others_fail_elsewhere() {
    let (_folder, mut service) = service().await;
    service.access = standing_still();
    with_password(&service, "admin", Role::Administrator, RIGHT).await;
    let mut refused = Vec::new();
    for _ in 0..6 {
        refused.push(sign_in_from(&service, ATTACKER, None, "admin", "guess").await.status);
    }
    assert_eq!(refused[..4], [StatusCode::UNAUTHORIZED; 4]);
    assert_eq!(refused[4..], [StatusCode::TOO_MANY_REQUESTS; 2]);
    // The attacker would wait even with the right password; the owner does not.
    let there = sign_in_from(&service, ATTACKER, None, "admin", RIGHT).await.status;
    assert_eq!(there, StatusCode::TOO_MANY_REQUESTS);
    let here = sign_in_from(&service, OWNER, None, "admin", RIGHT).await;
    assert_eq!(here.status, StatusCode::SEE_OTHER);
    assert_eq!(status(&service, &session_of(&here)).await, StatusCode::OK);
    service.stop().await;
}

#[tokio::test]
async fn known_browser_is_not_delayed_by_others_in_its_network() {
    let (_folder, mut service) = service().await;
    service.access = standing_still();
    with_password(&service, "Ada", Role::Clinician, RIGHT).await;
    with_password(&service, "Bob", Role::Clinician, RIGHT).await;
    let first = sign_in_from(&service, OWNER, None, "Ada", RIGHT).await;
    let browser = cookie_of(&first, "gaitwright_browser");
    for _ in 0..5 {
        for name in ["Ada", "Bob"] {
            sign_in_from(&service, OWNER, None, name, "guess").await;
        }
    }
    let elsewhere = sign_in_from(&service, OWNER, None, "Ada", RIGHT).await.status;
    assert_eq!(elsewhere, StatusCode::TOO_MANY_REQUESTS);
    let known = sign_in_from(&service, OWNER, Some(&browser), "Ada", RIGHT).await;
    assert_eq!(known.status, StatusCode::SEE_OTHER);
    assert_eq!(cookie_of(&known, "gaitwright_browser"), browser);
    // The browser is known for the user who signed in there; its own failures count.
    let other = sign_in_from(&service, OWNER, Some(&browser), "Bob", RIGHT).await.status;
    assert_eq!(other, StatusCode::TOO_MANY_REQUESTS);
    let mut own = Vec::new();
    for _ in 0..5 {
        own.push(sign_in_from(&service, OWNER, Some(&browser), "Ada", "guess").await.status);
    }
    assert_eq!(own[4], StatusCode::TOO_MANY_REQUESTS, "{own:?}");
    service.stop().await;
}

#[tokio::test]
async fn guesses_from_many_ipv6_networks_of_one_site_are_delayed() {
    let (_folder, mut service) = service().await;
    service.access = standing_still();
    with_password(&service, "Ada", Role::Clinician, RIGHT).await;
    let mut statuses = Vec::new();
    for subnet in 0..8 {
        let address = Ipv6Addr::new(0x2001, 0xdb8, 1, subnet, 0, 0, 0, 1);
        statuses.push(sign_in_from(&service, address, None, "Ada", "guess").await.status);
    }
    assert_eq!(statuses[..7], [StatusCode::UNAUTHORIZED; 7]);
    assert_eq!(statuses[7], StatusCode::TOO_MANY_REQUESTS);
    let other_site = Ipv6Addr::new(0x2001, 0xdb8, 2, 0, 0, 0, 0, 1);
    assert_eq!(sign_in_from(&service, other_site, None, "Ada", RIGHT).await.status, StatusCode::SEE_OTHER);
    service.stop().await;
}

#[tokio::test]
async fn guesses_from_many_networks_are_delayed_and_known_browsers_are_not() {
    let (folder, mut service) = service().await;
    let at = now().plus_seconds(3600);
    service.access = standing_at(at);
    with_password(&service, "Ada", Role::Clinician, RIGHT).await;
    let browser = cookie_of(&sign_in_from(&service, OWNER, None, "Ada", RIGHT).await, "gaitwright_browser");
    let mut writer = service.store.write().await.unwrap();
    for number in 1..=60 {
        let origin = AttemptOrigin { network: format!("198.51.100.{number}"), site: None, known: None };
        let _ = back_off::begin(&mut writer, at.plus_seconds(10 * (number - 60)), "Ada", origin).await.unwrap();
    }
    commit(writer).await.unwrap();
    service.stop().await;
    let mut service = start_anew(&folder.path().join("a.db")).await;
    service.access = standing_at(at);
    let refused = sign_in_from(&service, ATTACKER, None, "Ada", "guess").await;
    assert_eq!(refused.status, StatusCode::TOO_MANY_REQUESTS);
    // The clock goes on while the test runs.
    let wait: u64 = refused.headers["retry-after"].to_str().unwrap().parse().unwrap();
    assert!((5..=10).contains(&wait), "{wait}");
    // Another browser waits as well. Asked before passwords are hashed, which can take longer than the wait.
    assert_eq!(sign_in_from(&service, OWNER, None, "Ada", RIGHT).await.status, StatusCode::TOO_MANY_REQUESTS);
    // Other users, and browsers in which the user signed in earlier, do not wait.
    with_password(&service, "Bob", Role::Clinician, RIGHT).await;
    assert_eq!(sign_in_from(&service, OWNER, None, "Bob", RIGHT).await.status, StatusCode::SEE_OTHER);
    let known = sign_in_from(&service, OWNER, Some(&browser), "Ada", RIGHT).await;
    assert_eq!(known.status, StatusCode::SEE_OTHER);
    // Another browser gets in as soon as the wait is over, and ends the waits.
    service.access = standing_at(at.plus_seconds(10));
    assert_eq!(sign_in_from(&service, OWNER, None, "Ada", RIGHT).await.status, StatusCode::SEE_OTHER);
    assert_eq!(sign_in_from(&service, ATTACKER, None, "Ada", "guess").await.status, StatusCode::UNAUTHORIZED);
    service.stop().await;
}

#[tokio::test]
async fn cookie_of_a_known_browser_allows_no_more_guesses_than_many_networks() {
    let (_folder, service) = service().await;
    let user = with_password(&service, "Ada", Role::Clinician, RIGHT).await;
    let mut writer = service.store.write().await.unwrap();
    let (at, mut checked) = (now(), 0);
    for number in 1..=60 {
        let origin = AttemptOrigin { network: format!("198.51.100.{number}"), site: None, known: Some(user) };
        checked += u32::from(back_off::begin(&mut writer, at, "Ada", origin).await.unwrap().is_ok());
    }
    commit(writer).await.unwrap();
    assert!((50..=51).contains(&checked), "{checked}");
    service.stop().await;
}

#[tokio::test]
async fn failures_of_a_network_begin_with_the_first_failure_after_a_success() {
    let (_folder, service) = service().await;
    let network = "192.0.2.7";
    let mut writer = service.store.write().await.unwrap();
    let success = now();
    sign_in_failures::count(&mut writer, network, success, true).await.unwrap();
    sign_in_failures::remove(&mut writer, network).await.unwrap();
    let failure = now();
    for at in [failure, now()] {
        sign_in_failures::count(&mut writer, network, at, false).await.unwrap();
    }
    let found = sign_in_failures::of_network(&mut writer, network).await.unwrap().unwrap();
    assert!(success < failure);
    assert_eq!((found.attempts, found.first_at), (2, failure));
    drop(writer);
    service.stop().await;
}

#[tokio::test]
async fn ten_thousand_aborted_sign_ins_do_not_erase_the_failures_of_an_account() {
    let (folder, service) = service().await;
    with_password(&service, "Ada", Role::Administrator, RIGHT).await;
    for _ in 0..5 {
        sign_in_from(&service, ATTACKER, None, "Ada", "guess").await;
    }
    let network = "192.0.2.66";
    abort_attempts(&service, network, (0..10_000).map(|number| format!("nobody {number}"))).await;
    let waits = |service: &Service| {
        let store = service.store.clone();
        async move { sign_in_failures::find(&mut store.read().await.unwrap(), "ada", network).await.unwrap().unwrap() }
    };
    assert_eq!(waits(&service).await.count, 4);
    let mut reader = service.store.read().await.unwrap();
    let source = sign_in_failures::of_network(&mut reader, network).await.unwrap().unwrap();
    drop(reader);
    assert_eq!(source.attempts, 10_005, "every one is counted");
    assert!(source.names <= 1001, "and what is kept is bounded: {}", source.names);
    // Nor does a restart.
    service.stop().await;
    let mut service = start_anew(&folder.path().join("a.db")).await;
    service.access = Arc::new(AccessState::by_sign_in(3600.0));
    assert_eq!(waits(&service).await.count, 4);
    let mut statuses = Vec::new();
    for _ in 0..2 {
        statuses.push(sign_in_from(&service, ATTACKER, None, "Ada", "guess").await.status);
    }
    assert!(statuses.contains(&StatusCode::TOO_MANY_REQUESTS), "{statuses:?}");
    service.stop().await;
}

#[tokio::test]
async fn sign_in_with_another_name_does_not_reset_the_count_of_failures() {
    let (_folder, mut service) = service().await;
    service.access = standing_still();
    with_password(&service, "admin", Role::Administrator, RIGHT).await;
    with_password(&service, "Bea", Role::Rater, RIGHT).await;
    abort_attempts(&service, "192.0.2.66", (0..1001).map(|number| format!("nobody {number}"))).await;
    let mut statuses = Vec::new();
    for _ in 0..6 {
        statuses.push(sign_in_from(&service, ATTACKER, None, "admin", "guess").await.status);
        sign_in_from(&service, ATTACKER, None, "Bea", RIGHT).await;
    }
    assert_eq!(statuses.last(), Some(&StatusCode::TOO_MANY_REQUESTS), "{statuses:?}");
    service.stop().await;
}

#[tokio::test]
async fn audit_trail_shows_the_number_of_thirty_thousand_attempts() {
    let (_folder, service) = service().await;
    let admin = signed_in(&service, Role::Administrator).await;
    abort_attempts(&service, "192.0.2.66", (0..30_000).map(|_| "admin".to_owned())).await;
    let page = send(&service, &admin, &Method::GET, "/users", "", "").await.text;
    assert!(page.contains("192.0.2.66") && page.contains("30000"), "{page}");
    let noted = trail(&service, "sign_in.delay").await;
    assert_eq!(noted[0].detail["failed_attempts_of_network"], 20_000);
    assert!(noted.len() < 20, "{}", noted.len());

    // Counts that are a day old are deleted, and their number is written to the audit trail.
    let mut writer = service.store.write().await.unwrap();
    let origin = AttemptOrigin { network: "10.0.0.9".to_owned(), site: None, known: None };
    let tomorrow = now().plus_seconds(25 * 3600);
    let _ = back_off::begin(&mut writer, tomorrow, "Ada", origin).await.unwrap();
    commit(writer).await.unwrap();
    let forgotten = trail(&service, "sign_in.failures").await;
    assert_eq!(
        (&forgotten[0].detail["network"], &forgotten[0].detail["failed_attempts"]),
        (&json!("192.0.2.66"), &json!(30_000))
    );
    service.stop().await;
}

#[tokio::test]
async fn account_page_refuses_easily_guessed_passwords() {
    let (_folder, service) = service().await;
    let (_, link) = user(&service, "Ada Lovelace", Role::Clinician).await;
    let come = send(&service, &As::Nobody, &Method::POST, &format!("/sign-in/{link}"), FORM, "").await;
    let ada = session_of(&come);
    for weak in ["aaaaaaaaaaaaaaa", "PasswordPassword1!", "123456789012345", "ada lovelace 1815", "qwertyuiopasdfgh"] {
        let body = format!("password={}", weak.replace(' ', "+"));
        let refused = send(&service, &ada, &Method::POST, "/account", FORM, &body).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{weak}");
        assert!(refused.text.contains("too easy to guess"), "{}", refused.text);
    }
    let short = send(&service, &ada, &Method::POST, "/account", FORM, "password=Winter2025!!").await;
    assert_eq!(short.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert!(short.text.contains("at least 15 characters"), "{}", short.text);
    let set = send(&service, &ada, &Method::POST, "/account", FORM, "password=correct+horse+battery").await;
    assert_eq!(set.status, StatusCode::OK);
    service.stop().await;
}

#[tokio::test]
async fn administrators_who_never_signed_in_do_not_count_as_the_last_one() {
    let (_folder, service) = service().await;
    let admin = with_password(&service, "admin", Role::Administrator, RIGHT).await;
    let me = session_of(&sign_in_from(&service, OWNER, None, "admin", RIGHT).await);
    let (ada, link) = user(&service, "Ada", Role::Administrator).await;
    let disable = format!("/api/v1/users/{admin}/disable");
    let demote = format!("/api/v1/users/{admin}/role");
    let demoted = json!({"role": "clinician"});
    for (method, path, body) in [(Method::POST, &disable, &json!({})), (Method::PUT, &demote, &demoted)] {
        let (refused, problem) = change(&service, &me, &method, path, body).await;
        assert_eq!(refused, StatusCode::CONFLICT, "{path}");
        assert!(problem["detail"].as_str().unwrap().contains("last administrator who can sign in"), "{problem}");
    }
    // A session of a user without a password does not count as an administrator who can sign in.
    let come = send(&service, &As::Nobody, &Method::POST, &format!("/sign-in/{link}"), FORM, "").await;
    let ada_session = session_of(&come);
    assert_eq!(post(&service, &me, &disable, &json!({})).await.0, StatusCode::CONFLICT);
    let set = send(&service, &ada_session, &Method::POST, "/account", FORM, "password=battery+staple+meadow").await;
    let ada_session = session_of(&set);
    assert_eq!(post(&service, &ada_session, &disable, &json!({})).await.0, StatusCode::OK);
    assert_eq!(status(&service, &me).await, StatusCode::UNAUTHORIZED);
    let last = post(&service, &ada_session, &format!("/api/v1/users/{ada}/disable"), &json!({})).await;
    assert_eq!(last.0, StatusCode::CONFLICT);
    service.stop().await;
}

#[tokio::test]
async fn role_changes_apply_from_the_next_request_and_are_audited() {
    let (_folder, service) = service().await;
    let admin = signed_in(&service, Role::Administrator).await;
    let (ada, link) = user(&service, "Ada", Role::Rater).await;
    let come = send(&service, &As::Nobody, &Method::POST, &format!("/sign-in/{link}"), FORM, "").await;
    let ada_session = session_of(&come);
    let role = format!("/api/v1/users/{ada}/role");
    assert_eq!(
        send(&service, &ada_session, &Method::GET, "/api/v1/studies", "", "").await.status,
        StatusCode::FORBIDDEN
    );
    assert_eq!(put(&service, &ada_session, &role, &json!({"role": "administrator"})).await.0, StatusCode::FORBIDDEN);
    let (done, changed) = put(&service, &admin, &role, &json!({"role": "clinician"})).await;
    assert_eq!((done, &changed["role"]), (StatusCode::OK, &json!("clinician")));
    assert_eq!(send(&service, &ada_session, &Method::GET, "/api/v1/studies", "", "").await.status, StatusCode::OK);
    let form = format!("button=role&id={ada}&role=rater");
    let page = send(&service, &admin, &Method::POST, "/users", FORM, &form).await;
    assert!(page.status == StatusCode::OK && page.text.contains("Ada now has the role rater"), "{}", page.text);
    assert_eq!(
        send(&service, &ada_session, &Method::GET, "/api/v1/studies", "", "").await.status,
        StatusCode::FORBIDDEN
    );
    let details: Vec<Value> = trail(&service, "user.role").await.into_iter().map(|row| row.detail).collect();
    assert_eq!(
        details,
        [
            json!({"name": "Ada", "before": "clinician", "role": "rater"}),
            json!({"name": "Ada", "before": "rater", "role": "clinician"})
        ]
    );
    let (unknown, problem) = put(&service, &admin, &role, &json!({"role": "king"})).await;
    assert!(unknown.is_client_error() && problem["detail"].as_str().unwrap().contains("role"), "{problem}");
    service.stop().await;
}

/// A token that this user created.
async fn token_by(service: &Service, id: UserId, name: &str, role: Role) -> As {
    let actor = Caller::person(id, name, role).actor;
    let mut writer = service.store.write().await.unwrap();
    let new = NewToken { name: format!("rig of {name}"), scopes: vec![Right::Read], days: None };
    let (_, secret) = making::make(&mut writer, &actor, &new).await.unwrap();
    commit(writer).await.unwrap();
    As::Token(secret)
}

#[tokio::test]
async fn disabling_a_user_ends_their_tokens_and_sessions() {
    let (_folder, service) = service().await;
    let root = signed_in(&service, Role::Administrator).await;
    with_password(&service, "Dee", Role::Administrator, RIGHT).await;
    let mut made = Vec::new();
    for name in ["Ada", "Bob", "Cy"] {
        let id = with_password(&service, name, Role::Administrator, RIGHT).await;
        let session = session_of(&sign_in_from(&service, OWNER, None, name, RIGHT).await);
        made.push((id, session, token_by(&service, id, name, Role::Administrator).await));
    }
    for (_, session, token) in &made {
        assert_eq!((status(&service, session).await, status(&service, token).await), (StatusCode::OK, StatusCode::OK));
    }
    let to = |number: usize, what: &str| format!("/api/v1/users/{}/{what}", made[number].0);
    assert_eq!(post(&service, &root, &to(0, "disable"), &json!({})).await.0, StatusCode::OK);
    assert_eq!(post(&service, &root, &to(2, "disable"), &json!({})).await.0, StatusCode::OK);
    let both = [StatusCode::UNAUTHORIZED; 2];
    for ended in [0, 2] {
        assert_eq!([status(&service, &made[ended].1).await, status(&service, &made[ended].2).await], both, "{ended}");
    }
    // A former administrator keeps the session with fewer rights, and loses the tokens.
    assert_eq!(
        send(&service, &root, &Method::PUT, &to(1, "role"), "application/json", "{\"role\": \"rater\"}").await.status,
        StatusCode::OK
    );
    assert_eq!(status(&service, &made[1].1).await, StatusCode::OK);
    assert_eq!(status(&service, &made[1].2).await, StatusCode::UNAUTHORIZED);
    // Enabling the user restores neither sessions nor tokens.
    assert_eq!(post(&service, &root, &to(0, "enable"), &json!({})).await.0, StatusCode::OK);
    assert_eq!([status(&service, &made[0].1).await, status(&service, &made[0].2).await], both);
    assert_eq!(trail(&service, "token.revoke").await.len(), 3);
    service.stop().await;
}

#[tokio::test]
async fn sessions_are_listed_and_ended_one_by_one() {
    let (_folder, service) = service().await;
    let admin = signed_in(&service, Role::Administrator).await;
    with_password(&service, "Ada", Role::Rater, RIGHT).await;
    let desk = session_of(&sign_in_from(&service, OWNER, None, "Ada", RIGHT).await);
    let phone = session_of(&sign_in_from(&service, [10, 0, 0, 2], None, "Ada", RIGHT).await);
    let list = |who: As| {
        let service = &service;
        async move {
            send(service, &who, &Method::GET, "/api/v1/sessions", "", "").await.items().as_array().unwrap().clone()
        }
    };
    let own = list(desk.clone()).await;
    assert_eq!(own.len(), 2, "{own:?}");
    let of = |address: &str| own.iter().find(|s| s["address"] == address).unwrap()["id"].as_str().unwrap().to_owned();
    let (desk_id, phone_id) = (of("10.0.0.1"), of("10.0.0.2"));
    let all = list(admin.clone()).await;
    assert_eq!(all.len(), 3);
    let admins = all.iter().find(|s| s["user_name"] != "Ada").unwrap()["id"].as_str().unwrap().to_owned();
    assert!(list(token(&service, &[Right::Read]).await).await.is_empty());

    let end = |id: &str| format!("/api/v1/sessions/{id}/end");
    assert_eq!(post(&service, &desk, &end(&admins), &json!({})).await.0, StatusCode::NOT_FOUND, "not one's own");
    let form = format!("id={admins}");
    let page = send(&service, &desk, &Method::POST, "/account/sessions", FORM, &form).await;
    assert_eq!(page.status, StatusCode::NOT_FOUND);
    assert_eq!(status(&service, &admin).await, StatusCode::OK);
    // Users end their own sessions on the page; an administrator ends any, over REST or on the page.
    let account = send(&service, &desk, &Method::GET, "/account", "", "").await.text;
    assert!(
        account.contains(&phone_id) && account.contains("this session") && !account.contains(&desk_id),
        "{account}"
    );
    let form = format!("id={phone_id}");
    let page = send(&service, &desk, &Method::POST, "/account/sessions", FORM, &form).await;
    assert_eq!(page.status, StatusCode::SEE_OTHER);
    assert_eq!(
        [status(&service, &desk).await, status(&service, &phone).await],
        [StatusCode::OK, StatusCode::UNAUTHORIZED]
    );
    let form = format!("button=end_session&id={desk_id}");
    let page = send(&service, &admin, &Method::POST, "/users", FORM, &form).await;
    assert!(page.text.contains("Ended a session of Ada"), "{}", page.text);
    assert_eq!(status(&service, &desk).await, StatusCode::UNAUTHORIZED);
    assert_eq!(list(admin.clone()).await.len(), 1);
    assert_eq!(trail(&service, "session.end").await.len(), 2);
    service.stop().await;
}

/// A clock that a test sets, s from the present.
fn clock(offset: &Arc<AtomicI64>) -> Clock {
    let offset = Arc::clone(offset);
    Clock::over(move || now().plus_seconds(offset.load(Ordering::SeqCst)))
}

fn access(limits: SessionLimits, offset: &Arc<AtomicI64>) -> Arc<AccessState> {
    let mut access = AccessState::by_sign_in(limits.idle_seconds);
    (access.limits, access.clock) = (limits, clock(offset));
    Arc::new(access)
}

const LIMITS: SessionLimits = SessionLimits { idle_seconds: 3600.0, lifetime_seconds: 8.0 * 3600.0 };

#[tokio::test]
async fn active_sessions_end_after_their_lifetime() {
    let (_folder, mut service) = service().await;
    let offset = Arc::new(AtomicI64::new(0));
    service.access = access(LIMITS, &offset);
    let ada = signed_in(&service, Role::Clinician).await;
    for minutes in (0..8 * 60).step_by(30) {
        offset.store(60 * minutes, Ordering::SeqCst);
        assert_eq!(status(&service, &ada).await, StatusCode::OK, "after {minutes} minutes");
    }
    offset.store(8 * 3600 + 5, Ordering::SeqCst);
    assert_eq!(status(&service, &ada).await, StatusCode::UNAUTHORIZED);
    service.stop().await;
}

#[tokio::test]
async fn clock_that_is_set_back_revives_no_session_token_or_link() {
    let (folder, mut service) = service().await;
    let offset = Arc::new(AtomicI64::new(0));
    service.access = access(LIMITS, &offset);
    let ada = signed_in(&service, Role::Clinician).await;
    let script = token(&service, &[Right::Read]).await;
    let (_, link) = user(&service, "Bob", Role::Clinician).await;
    let use_link = |service: &Service| {
        let (router, path) = (service.router(), format!("/sign-in/{link}"));
        let request = Request::post(path).header(header::CONTENT_TYPE, FORM).body(Body::empty()).unwrap();
        async move { router.oneshot(request).await.unwrap().status() }
    };
    assert_eq!([status(&service, &ada).await, status(&service, &script).await], [StatusCode::OK; 2]);
    // Two days later all sessions have expired, and the service has recorded that time.
    offset.store(2 * 24 * 3600, Ordering::SeqCst);
    let over = [StatusCode::UNAUTHORIZED; 3];
    let all = async |service: &Service| {
        [status(service, &ada).await, status(service, &script).await, use_link(service).await]
    };
    assert_eq!(all(&service).await, over);
    offset.store(0, Ordering::SeqCst);
    assert_eq!(all(&service).await, over, "the clock was set back");
    service.stop().await;
    let mut service = start_anew(&folder.path().join("a.db")).await;
    service.access = access(LIMITS, &offset);
    assert_eq!(all(&service).await, over, "and the service started anew");
    // New sessions have their full lifetime, and time continues.
    let (_, fresh) = user(&service, "Cy", Role::Clinician).await;
    let come = send(&service, &As::Nobody, &Method::POST, &format!("/sign-in/{fresh}"), FORM, "").await;
    assert_eq!(status(&service, &session_of(&come)).await, StatusCode::OK);
    let mut reader = service.store.read().await.unwrap();
    let before: Instant = service.access.clock.now(&mut reader).await.unwrap();
    tokio::time::sleep(Duration::from_millis(20)).await;
    assert!(service.access.clock.now(&mut reader).await.unwrap() > before);
    drop(reader);
    service.stop().await;
}

/// Reads an event stream until it ends, and returns its text.
async fn read_to_end(mut body: axum::body::BodyDataStream) -> String {
    let mut text = Vec::new();
    let all = async {
        while let Some(Ok(bytes)) = body.next().await {
            text.extend_from_slice(&bytes);
        }
    };
    tokio::time::timeout(Duration::from_secs(5), all).await.expect("the stream goes on");
    String::from_utf8(text).unwrap()
}

async fn listen(service: &Service, who: &As, path: &str) -> axum::body::BodyDataStream {
    let request = Request::get(path);
    let request = match who {
        As::Session(secret) => request.header(header::COOKIE, format!("gaitwright_session={secret}")),
        As::Token(secret) => request.header(header::AUTHORIZATION, format!("Bearer {secret}")),
        As::Nobody => request,
    };
    let answer = service.router().oneshot(request.body(Body::empty()).unwrap()).await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK);
    let mut body = answer.into_body().into_data_stream();
    let first = body.next().await.unwrap().unwrap();
    assert!(first.starts_with(b"event: study_state"), "{first:?}");
    body
}

#[tokio::test]
async fn event_streams_end_when_their_authorization_ends() {
    let (_folder, mut service) = service().await;
    let offset = Arc::new(AtomicI64::new(0));
    service.access = access(LIMITS, &offset);
    let admin = with_password(&service, "Ada", Role::Administrator, RIGHT).await;
    let root = session_of(&sign_in_from(&service, OWNER, None, "Ada", RIGHT).await);
    let study = service.study(|new| (new.number_of_trials, new.start) = (2, false)).await;
    let path = format!("/api/v1/studies/{study}/events");
    let users = ["signed out", "ended", "disabled", "demoted", "idle"];
    let mut ids = Vec::new();
    let mut listening = Vec::new();
    for name in users {
        ids.push(with_password(&service, name, Role::Clinician, RIGHT).await);
        let session = session_of(&sign_in_from(&service, OWNER, None, name, RIGHT).await);
        listening.push((listen(&service, &session, &path).await, session));
    }
    // Raters reach the studies that they are assigned to: this one loses the right to read alone.
    member(&service, study, MemberKind::User, "demoted").await;
    let script = token_by(&service, admin, "Ada", Role::Administrator).await;
    let by_token = listen(&service, &script, &path).await;
    let (mut streams, sessions): (Vec<_>, Vec<_>) = listening.into_iter().unzip();

    let done = send(&service, &sessions[0], &Method::POST, "/sign-out", FORM, "").await;
    assert_eq!(done.status, StatusCode::SEE_OTHER);
    let live = send(&service, &sessions[1], &Method::GET, "/api/v1/sessions", "", "").await.items();
    let ended = format!("/api/v1/sessions/{}/end", live[0]["id"].as_str().unwrap());
    assert_eq!(post(&service, &root, &ended, &json!({})).await.0, StatusCode::OK);
    let user = |number: usize, what: &str| format!("/api/v1/users/{}/{what}", ids[number]);
    assert_eq!(post(&service, &root, &user(2, "disable"), &json!({})).await.0, StatusCode::OK);
    assert_eq!(
        send(&service, &root, &Method::PUT, &user(3, "role"), "application/json", "{\"role\": \"rater\"}").await.status,
        StatusCode::OK
    );
    let tokens = send(&service, &root, &Method::GET, "/api/v1/tokens", "", "").await.items();
    let revoke = format!("/api/v1/tokens/{}/revoke", tokens[0]["id"].as_str().unwrap());
    assert_eq!(post(&service, &root, &revoke, &json!({})).await.0, StatusCode::OK);
    let idle = streams.pop().unwrap();
    for (stream, name) in streams.into_iter().zip(users) {
        let rest = read_to_end(stream).await;
        assert!(!rest.contains("event: "), "{name}: {rest}");
    }
    read_to_end(by_token).await;
    offset.store(3700, Ordering::SeqCst);
    read_to_end(idle).await;

    // The subject withdraws consent, which ends every stream of the study.
    let root = session_of(&sign_in_from(&service, OWNER, None, "Ada", RIGHT).await);
    let stream = listen(&service, &root, &path).await;
    let withdraw = format!("/api/v1/subjects/{}/withdraw", service.subject().await);
    let (withdrawn, problem) = post(&service, &root, &withdraw, &json!({"reason": "asked to"})).await;
    assert!(withdrawn.is_success(), "{problem}");
    read_to_end(stream).await;
    service.stop().await;
}

#[test]
fn one_module_creates_event_streams_and_checks_the_caller() {
    let found = sources::of_server();
    let makes = |text: &str| ["Sse::new", "Body::from_stream", "StreamBody"].iter().any(|way| text.contains(way));
    let makers: Vec<&str> = found.iter().filter(|(_, text)| makes(text)).map(|(path, _)| path.as_str()).collect();
    // An archive is a finite response, and the other file changes requests.
    let finite = ["http/src/api/study_archives.rs", "http/src/request_body.rs"];
    let (files, makers): (Vec<&str>, Vec<&str>) = makers.iter().partition(|path| finite.contains(path));
    assert_eq!(files.len(), 2);
    assert!(found.len() > 100 && makers.len() == 1 && makers[0] == "http/src/study_listener.rs", "{makers:?}");
}

#[tokio::test]
async fn new_administrator_is_created_if_all_are_disabled() {
    let (_folder, service) = service().await;
    let mut writer = service.store.write().await.unwrap();
    let add = NewUser { name: "admin".to_owned(), role: Role::Administrator };
    let admin = user_administration::add(&mut writer, &Actor::program(), &add).await.unwrap();
    assert_eq!(user_administration::operator_administrator(&mut writer).await.unwrap().id, admin.id);
    let disable = "update users set disabled_at = created_at";
    sqlx::query(disable).execute(&mut **writer).await.unwrap();
    let fresh = user_administration::operator_administrator(&mut writer).await.unwrap();
    assert_eq!((fresh.name.as_str(), fresh.role, fresh.has_password), ("admin-2", Role::Administrator, false));
    assert!(user_administration::link(&mut writer, &Actor::terminal(), fresh.id).await.is_ok());
    commit(writer).await.unwrap();
    service.stop().await;
}
