//! Access control: roles, tokens, sessions, links, back-off.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Method, Request, StatusCode, header};
use futures_util::future::join_all;
use gaitwright_http::{AccessState, openapi};
use gaitwright_service::access::{Right, Role, secret, user_administration};
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::commit;
use gaitwright_store::members::MemberKind;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers::{As, FORM, member, send, service, session_of, signed_in, token, user};
use gaitwright_tests::page_routes;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::sync::Arc;

const UNKNOWN: &str = "01890000-0000-7000-8000-000000000000";

/// Every kind of caller, with its rights.
async fn everybody(service: &Service) -> Vec<(As, Vec<Right>)> {
    let mut callers = vec![(As::Nobody, Vec::new())];
    for role in Role::ALL {
        let rights = Right::ALL.into_iter().filter(|right| role.rights().has(*right)).collect();
        callers.push((signed_in(service, role).await, rights));
    }
    for right in [Right::Read, Right::Run, Right::Answer, Right::Rate, Right::Device] {
        callers.push((token(service, &[right]).await, vec![right]));
    }
    callers
}

#[tokio::test]
async fn every_role_and_scope_has_exactly_the_described_rights() {
    let (_folder, service) = service().await;
    let callers = everybody(&service).await;
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut checked = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            let ways = &operation["security"];
            let needed = if ways[0]["token"].is_array() { &ways[0]["token"] } else { &ways[0]["session"] };
            let method: Method = method.to_uppercase().parse().unwrap();
            let address = path
                .replace("{id}", UNKNOWN)
                .replace("{code}", "unknown")
                .replace("{side}", "first")
                .replace("{file}", "a.svg");
            for (who, rights) in &callers {
                let answer = send(&service, who, &method, &address, "application/json", "{}").await;
                let what = format!("{method} {path} as {who:?}: {} {}", answer.status, answer.text);
                let allowed = match needed[0].as_str() {
                    Some(needed) => rights.iter().any(|right| right.as_str() == needed),
                    None => needed.is_null() || !matches!(who, As::Nobody),
                };
                let refusal = if matches!(who, As::Nobody) { StatusCode::UNAUTHORIZED } else { StatusCode::FORBIDDEN };
                if allowed {
                    assert!(!matches!(answer.status, StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN), "{what}");
                    let status = answer.status.as_u16().to_string();
                    assert!(operation["responses"][&status].is_object(), "undocumented: {what}");
                } else {
                    assert_eq!(answer.status, refusal, "{what}");
                }
                assert!(!answer.status.is_server_error(), "{what}");
                checked += 1;
            }
        }
    }
    assert!(checked > 250, "{checked}");
    service.stop().await;
}

/// The pages, as in the router. A page that is not listed here fails the test.
const PAGES: [(&str, Option<Right>); 82] = [
    ("get /", Some(Right::Read)),
    ("get /studies/new", Some(Right::Run)),
    ("post /studies/new", Some(Right::Run)),
    ("post /studies/new/check", Some(Right::Run)),
    ("post /studies/sample", Some(Right::Run)),
    ("get /studies/{id}/details", Some(Right::Read)),
    ("post /studies/{id}/details", Some(Right::Run)),
    ("get /studies/compare", Some(Right::Read)),
    ("get /studies/{id}", Some(Right::Read)),
    ("get /studies/{id}/live", Some(Right::Read)),
    ("get /studies/{id}/analysis", Some(Right::Read)),
    ("get /studies/{id}/atlas", Some(Right::Read)),
    ("post /studies/{id}/atlas", Some(Right::Run)),
    ("get /studies/{id}/figures", Some(Right::Read)),
    ("post /studies/{id}/do", Some(Right::Run)),
    ("get /studies/{id}/compare", Some(Right::Read)),
    ("post /studies/{id}/compare", Some(Right::Answer)),
    ("post /studies/{id}/retract", Some(Right::Answer)),
    ("post /studies/{id}/undo", Some(Right::Answer)),
    ("get /studies/{id}/members", Some(Right::Read)),
    ("post /studies/{id}/members", Some(Right::Run)),
    ("get /subjects", Some(Right::Read)),
    ("post /subjects", Some(Right::Run)),
    ("get /subjects/{id}", Some(Right::Read)),
    ("post /subjects/{id}/consent", Some(Right::Run)),
    ("post /subjects/{id}/withdraw", Some(Right::Run)),
    ("post /subjects/{id}/correct", Some(Right::Run)),
    ("get /subjects/{id}/muscles", Some(Right::Read)),
    ("post /subjects/{id}/muscles", Some(Right::Run)),
    ("get /devices", Some(Right::Read)),
    ("get /devices/{id}", Some(Right::Read)),
    ("post /devices/{id}", Some(Right::Run)),
    ("get /trials/{id}", Some(Right::Read)),
    ("get /trials/{id}/running", Some(Right::Read)),
    ("post /trials/{id}/certify", Some(Right::Run)),
    ("post /trials/{id}/explain", Some(Right::Run)),
    ("post /trials/{id}/relaxed-trial", Some(Right::Run)),
    ("post /trials/{id}/execution-report", Some(Right::Run)),
    ("post /trials/{id}/safety-review", Some(Right::Answer)),
    ("get /reference-gaits", Some(Right::Read)),
    ("post /reference-gaits", Some(Right::Run)),
    ("get /reference-gaits/{id}", Some(Right::Read)),
    ("post /jobs/{id}/cancel", Some(Right::Run)),
    ("post /units", Some(Right::Read)),
    ("get /rate", Some(Right::Rate)),
    ("post /rate/{id}", Some(Right::Rate)),
    ("get /rate/pair/{code}", Some(Right::Rate)),
    ("post /rate/pair/{code}", Some(Right::Rate)),
    ("post /rate/pair/{code}/retract", Some(Right::Rate)),
    ("get /studies/{id}/lab", Some(Right::Read)),
    ("post /studies/{id}/lab", Some(Right::Run)),
    ("get /lab-sessions/{id}", Some(Right::Read)),
    ("post /lab-sessions/{id}/close", Some(Right::Run)),
    ("post /lab-sessions/{id}/unblind", Some(Right::Administer)),
    ("post /trials/{id}/safety-report", Some(Right::Answer)),
    ("post /lab-sessions/{id}/measurement-files/emg", Some(Right::Run)),
    ("post /lab-sessions/{id}/measurement-files/joint-angles", Some(Right::Run)),
    ("post /lab-sessions/{id}/process", Some(Right::Run)),
    ("get /lab", Some(Right::Rate)),
    ("get /lab/{id}", Some(Right::Rate)),
    ("post /lab/{id}", Some(Right::Rate)),
    ("post /lab/{id}/answer", Some(Right::Rate)),
    ("post /lab/{id}/retract", Some(Right::Rate)),
    ("get /users", Some(Right::Administer)),
    ("post /users", Some(Right::Administer)),
    ("get /audit", Some(Right::Administer)),
    ("get /access-log", Some(Right::Administer)),
    ("get /system", Some(Right::Read)),
    ("post /system/backup", Some(Right::Administer)),
    ("get /help", None),
    ("get /help/{name}", None),
    ("get /help/images/{name}", None),
    ("get /problems", None),
    ("get /problems/{name}", None),
    ("get /api", None),
    ("get /sign-in", None),
    ("post /sign-in", None),
    ("get /sign-in/{link}", None),
    ("post /sign-in/{link}", None),
    ("post /sign-out", None),
    ("post /account/sessions", None),
    ("get /account", None),
];

#[tokio::test]
async fn every_page_is_shown_to_users_with_its_right() {
    let (_folder, service) = service().await;
    let callers = everybody(&service).await;
    let mut seen = BTreeSet::new();
    for (method, path) in page_routes::all() {
        if (path.as_str(), &method) == ("/account", &Method::POST) {
            continue;
        }
        let entry = format!("{} {path}", method.as_str().to_lowercase());
        let (_, needed) = PAGES.iter().find(|(known, _)| *known == entry).unwrap_or_else(|| panic!("{entry}"));
        seen.insert(entry.clone());
        let Some(needed) = needed else { continue };
        let address = path
            .replace("{id}", UNKNOWN)
            .replace("{code}", "unknown")
            .replace("{side}", "first")
            .replace("{file}", "a.svg");
        for (who, rights) in &callers {
            let answer = send(&service, who, &method, &address, FORM, "").await;
            let what = format!("{entry} as {who:?}: {}", answer.status);
            if entry == "get /" && rights.contains(&Right::Rate) && !rights.contains(needed) {
                assert_eq!(answer.headers["location"], "/rate", "{what}");
            } else if rights.contains(needed) {
                // The sample study needs no fields, so it is created.
                let created = entry == "post /studies/sample" && answer.status == StatusCode::SEE_OTHER;
                let refused = matches!(answer.status, StatusCode::SEE_OTHER | StatusCode::FORBIDDEN);
                assert!(created || !refused, "{what}");
            } else if matches!(who, As::Nobody) && method == Method::POST {
                assert_eq!(answer.status, StatusCode::UNAUTHORIZED, "{what}");
            } else if matches!(who, As::Nobody) {
                assert_eq!(answer.headers["location"], "/sign-in", "{what}");
            } else {
                assert_eq!(answer.status, StatusCode::FORBIDDEN, "{what}");
            }
        }
    }
    assert_eq!(seen, PAGES.iter().map(|(entry, _)| (*entry).to_owned()).collect());
    service.stop().await;
}

/// The fields of the first form of a page, as a browser would send them.
fn hidden_fields(page: &str) -> Vec<(String, String)> {
    let unescaped = |text: &str| text.replace("&#38;", "&").replace("&#34;", "\"").replace("&#39;", "'");
    let value = |tag: &str, name: &str| Some(tag.split(&format!("{name}=\"")).nth(1)?.split('"').next()?.to_owned());
    let hidden = page.split("<input type=\"hidden\" ").skip(1);
    hidden.map(|tag| (value(tag, "name").unwrap(), unescaped(&value(tag, "value").unwrap()))).collect()
}

/// As a form sends them.
fn form_of(fields: &[(String, String)]) -> String {
    let coded = |text: &str| text.bytes().map(|byte| format!("%{byte:02X}")).collect::<Vec<_>>().concat();
    fields.iter().map(|(name, value)| format!("{}={}", coded(name), coded(value))).collect::<Vec<_>>().join("&")
}

#[tokio::test]
async fn answer_after_the_session_ended_is_kept_until_sign_in() {
    let (_folder, mut service) = service().await;
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 3)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let (rater, _) = user(&service, "R1", Role::Rater).await;
    member(&service, study, MemberKind::User, "R1").await;
    let mut writer = service.store.write().await.unwrap();
    let hashed = secret::hash_password("correct horse battery").unwrap();
    user_administration::set_password(&mut writer, &Actor::program(), rater, &hashed).await.unwrap();
    commit(writer).await.unwrap();
    let credentials = "name=R1&password=correct+horse+battery";
    let session = session_of(&send(&service, &As::Nobody, &Method::POST, "/sign-in", FORM, credentials).await);
    let taken = send(&service, &session, &Method::POST, &format!("/rate/{study}"), FORM, "").await;
    let pair = taken.headers["location"].to_str().unwrap().to_owned();

    service.access = Arc::new(AccessState::by_sign_in(0.0));
    let answer = "response_ms=900&answer=first&note=%22steady%22+%26+calm";
    let refused = send(&service, &session, &Method::POST, &pair, FORM, answer).await;
    assert_eq!(refused.status, StatusCode::UNAUTHORIZED);
    assert!(refused.text.contains("Your entry was not saved"), "{}", refused.text);
    service.access = Arc::new(AccessState::by_sign_in(3600.0));
    let rows_before = service.feedback(study).await.len();

    // A wrong password does not lose the entry either.
    let carried = form_of(&hidden_fields(&refused.text));
    let wrong =
        send(&service, &As::Nobody, &Method::POST, "/sign-in", FORM, &format!("name=R1&password=x&{carried}")).await;
    assert_eq!((wrong.status, hidden_fields(&wrong.text)), (StatusCode::UNAUTHORIZED, hidden_fields(&refused.text)));
    let signed_in =
        send(&service, &As::Nobody, &Method::POST, "/sign-in", FORM, &format!("{credentials}&{carried}")).await;
    assert!(signed_in.text.contains(&format!("action=\"{pair}\"")), "{}", signed_in.text);
    assert_eq!(service.feedback(study).await.len(), rows_before, "signing in stores no answer");
    let body = form_of(&hidden_fields(&signed_in.text));
    let saved = send(&service, &session_of(&signed_in), &Method::POST, &pair, FORM, &body).await;
    assert_eq!(saved.status, StatusCode::SEE_OTHER, "{}", saved.text);
    let row = service.feedback(study).await.pop().unwrap();
    assert_eq!((row.author.as_str(), row.note.as_str()), ("R1", "\"steady\" & calm"));

    // New passwords are not kept, and entries are not sent to other sites.
    let account = send(&service, &As::Nobody, &Method::POST, "/account", FORM, "password=correct+horse+battery").await;
    assert!(account.status == StatusCode::UNAUTHORIZED && !account.text.contains("correct"), "{}", account.text);
    for elsewhere in ["https://example.org/", "//example.org/", "/\\example.org/"] {
        let body = format!("{credentials}&to={elsewhere}&fields=a%3Db");
        let there = send(&service, &As::Nobody, &Method::POST, "/sign-in", FORM, &body).await;
        assert_eq!(there.headers["location"], "/rate");
    }
    service.stop().await;
}

#[tokio::test]
async fn error_page_links_only_to_permitted_pages() {
    let (_folder, service) = service().await;
    let main = |page: &str| page.contains("<nav aria-label=\"Main\">");
    for (role, staff) in [(Role::Rater, false), (Role::Clinician, true)] {
        let (_, link) = user(&service, role.as_str(), role).await;
        let who = session_of(&send(&service, &As::Nobody, &Method::POST, &format!("/sign-in/{link}"), FORM, "").await);
        for (address, status) in [("/users", StatusCode::FORBIDDEN), ("/nowhere", StatusCode::NOT_FOUND)] {
            let shown = send(&service, &who, &Method::GET, address, "", "").await;
            assert_eq!((shown.status, shown.text.contains("href=\"/subjects\"")), (status, staff), "{}", shown.text);
            assert!(main(&shown.text) && (staff || shown.text.contains("href=\"/rate\"")), "{}", shown.text);
        }
    }
    let shown = send(&service, &As::Nobody, &Method::GET, "/nowhere", "", "").await;
    assert!(shown.status == StatusCode::NOT_FOUND && !main(&shown.text), "{}", shown.text);
    service.stop().await;
}

#[tokio::test]
async fn sign_in_link_works_once_and_then_the_password() {
    let (_folder, service) = service().await;
    let (_, link) = user(&service, "Ada", Role::Administrator).await;
    let path = format!("/sign-in/{link}");
    assert_eq!(send(&service, &As::Nobody, &Method::GET, &path, FORM, "").await.status, StatusCode::OK);
    let first = send(&service, &As::Nobody, &Method::POST, &path, FORM, "").await;
    assert_eq!((first.status, &first.headers["location"]), (StatusCode::SEE_OTHER, &"/".parse().unwrap()));
    let ada = session_of(&first);
    let again = send(&service, &As::Nobody, &Method::POST, &path, FORM, "").await;
    assert_eq!(again.status, StatusCode::UNAUTHORIZED, "a link works once");
    assert!(again.text.contains("This link was already used or has expired"), "{}", again.text);

    let me = send(&service, &ada, &Method::GET, "/api/v1/me", "", "").await.json();
    assert_eq!((&me["name"], &me["role"]), (&json!("Ada"), &json!("administrator")));
    let short = send(&service, &ada, &Method::POST, "/account", FORM, "password=short").await;
    assert_eq!(short.status, StatusCode::UNPROCESSABLE_ENTITY);
    let set = send(&service, &ada, &Method::POST, "/account", FORM, "password=correct+horse+battery").await;
    let newer = session_of(&set);
    assert_eq!(send(&service, &ada, &Method::GET, "/api/v1/me", "", "").await.status, StatusCode::UNAUTHORIZED);
    assert_eq!(send(&service, &newer, &Method::GET, "/api/v1/me", "", "").await.status, StatusCode::OK);

    let body = "name=ada&password=correct+horse+battery";
    let by_password = session_of(&send(&service, &As::Nobody, &Method::POST, "/sign-in", FORM, body).await);
    let out = send(&service, &by_password, &Method::POST, "/sign-out", FORM, "").await;
    assert!(out.headers["set-cookie"].to_str().unwrap().contains("Max-Age=0"));
    assert_eq!(send(&service, &by_password, &Method::GET, "/", "", "").await.headers["location"], "/sign-in");

    // No secret is in the record.
    service.store.close().await;
    let bytes = std::fs::read(service.store.path()).unwrap();
    for secret in [link.as_str(), "correct horse battery"] {
        assert!(!bytes.windows(secret.len()).any(|window| window == secret.as_bytes()), "{secret}");
    }
}

#[tokio::test]
async fn password_change_requires_the_old_password_or_a_recent_link() {
    let (_folder, service) = service().await;
    let (id, link) = user(&service, "Ada", Role::Clinician).await;
    let come = |link: &str| {
        let (service, path) = (&service, format!("/sign-in/{link}"));
        async move { session_of(&send(service, &As::Nobody, &Method::POST, &path, FORM, "").await) }
    };
    let change = |who: &As, body: &str| {
        let (service, who, body) = (&service, who.clone(), body.to_owned());
        async move { send(service, &who, &Method::POST, "/account", FORM, &body).await }
    };
    // The user has no password yet. Afterwards, a session is not enough to replace it.
    let first = session_of(&change(&come(&link).await, "password=correct+horse+battery").await);
    for body in [
        "password=battery+staple+meadow",
        "password=battery+staple+meadow&present=",
        "password=battery+staple+meadow&present=wrong",
    ] {
        let refused = change(&first, body).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{body}");
        assert!(refused.text.contains("The current password is wrong"), "{}", refused.text);
    }
    let page = send(&service, &first, &Method::GET, "/account", FORM, "").await;
    assert!(page.text.contains("name=\"present\""), "{}", page.text);
    let second = session_of(&change(&first, "password=battery+staple+meadow&present=correct+horse+battery").await);
    // Guesses are delayed here as on the sign-in page.
    let mut statuses = Vec::new();
    for _ in 0..6 {
        statuses.push(change(&second, "password=another+horse+battery&present=guess").await.status);
    }
    assert_eq!(statuses.last(), Some(&StatusCode::TOO_MANY_REQUESTS), "{statuses:?}");

    // A user who forgot the password gets a link, and need not enter the current password for an hour.
    let mut writer = service.store.write().await.unwrap();
    let link = user_administration::link(&mut writer, &Actor::program(), id).await.unwrap();
    commit(writer).await.unwrap();
    let fresh = come(&link).await;
    let page = send(&service, &fresh, &Method::GET, "/account", FORM, "").await;
    assert!(!page.text.contains("name=\"present\""), "{}", page.text);
    let mut writer = service.store.write().await.unwrap();
    let age =
        "update sessions set created_at = strftime('%Y-%m-%dT%H:%M:%fZ', 'now', '-2 hours') where ended_at is null";
    sqlx::query(age).execute(&mut **writer).await.unwrap();
    commit(writer).await.unwrap();
    let page = send(&service, &fresh, &Method::GET, "/account", FORM, "").await;
    assert!(page.text.contains("name=\"present\""), "{}", page.text);
    service.stop().await;
}

#[tokio::test]
async fn wrong_passwords_wait_longer_each_time_and_are_audited() {
    let (_folder, service) = service().await;
    let (id, _) = user(&service, "Ada", Role::Clinician).await;
    let hashed = secret::hash_password("correct horse battery").unwrap();
    let mut writer = service.store.write().await.unwrap();
    user_administration::set_password(&mut writer, &Actor::program(), id, &hashed).await.unwrap();
    commit(writer).await.unwrap();
    let wrong = "name=Ada&password=wrong";
    for _ in 0..4 {
        let refused = send(&service, &As::Nobody, &Method::POST, "/sign-in", FORM, wrong).await;
        assert_eq!(refused.status, StatusCode::UNAUTHORIZED);
    }
    let right = "name=Ada&password=correct+horse+battery";
    let waits = send(&service, &As::Nobody, &Method::POST, "/sign-in", FORM, right).await;
    assert_eq!(waits.status, StatusCode::TOO_MANY_REQUESTS, "even the right one");
    let rows = audit::page(&mut service.store.read().await.unwrap(), "", None, 100).await.unwrap();
    let count = |change: &str| rows.iter().filter(|row| row.change == change).count();
    assert_eq!((count("sign_in.refused"), count("sign_in.delay")), (4, 1));
    assert_eq!(rows[0].detail["failed_attempts_of_network"], 5);
    service.stop().await;
}

#[tokio::test]
async fn sessions_end_if_idle_or_disabled_and_tokens_if_revoked() {
    let (_folder, mut service) = service().await;
    let admin = signed_in(&service, Role::Administrator).await;
    let clinician = signed_in(&service, Role::Clinician).await;
    let script = token(&service, &[Right::Read]).await;
    let me = "/api/v1/me";
    for who in [&admin, &clinician, &script] {
        assert_eq!(send(&service, who, &Method::GET, me, "", "").await.status, StatusCode::OK);
    }
    let users = send(&service, &admin, &Method::GET, "/api/v1/users", "", "").await.items();
    let id_of = |role: &str| {
        let all = users.as_array().unwrap();
        all.iter().find(|user| user["role"] == role).unwrap()["id"].as_str().unwrap().to_owned()
    };
    let disable = |id: String| format!("/api/v1/users/{id}/disable");
    let json = "application/json";
    let last = send(&service, &admin, &Method::POST, &disable(id_of("administrator")), json, "").await;
    assert_eq!(last.status, StatusCode::CONFLICT, "somebody must administer");
    assert_eq!(
        send(&service, &admin, &Method::POST, &disable(id_of("clinician")), json, "").await.status,
        StatusCode::OK
    );
    assert_eq!(send(&service, &clinician, &Method::GET, me, "", "").await.status, StatusCode::UNAUTHORIZED);

    let all = send(&service, &admin, &Method::GET, "/api/v1/tokens", "", "").await;
    let As::Token(secret) = &script else { panic!() };
    assert!(!all.text.contains(secret.as_str()));
    let revoke = format!("/api/v1/tokens/{}/revoke", all.items()[0]["id"].as_str().unwrap());
    assert_eq!(send(&service, &admin, &Method::POST, &revoke, json, "").await.status, StatusCode::OK);
    assert_eq!(send(&service, &script, &Method::GET, me, "", "").await.status, StatusCode::UNAUTHORIZED);

    service.access = Arc::new(AccessState::by_sign_in(0.0));
    tokio::time::sleep(std::time::Duration::from_millis(5)).await;
    assert_eq!(send(&service, &admin, &Method::GET, me, "", "").await.status, StatusCode::UNAUTHORIZED);
    service.stop().await;
}

#[tokio::test]
async fn signed_in_browser_without_an_origin_cannot_change_anything() {
    let (_folder, service) = service().await;
    let As::Session(secret) = signed_in(&service, Role::Administrator).await else { panic!() };
    for (header_name, value, expected) in [
        ("x-nothing", "", StatusCode::FORBIDDEN),
        ("sec-fetch-site", "cross-site", StatusCode::FORBIDDEN),
        ("sec-fetch-site", "same-site", StatusCode::FORBIDDEN),
        ("origin", "https://evil.example", StatusCode::FORBIDDEN),
        ("sec-fetch-site", "same-origin", StatusCode::CREATED),
    ] {
        let request = Request::post("/api/v1/subjects")
            .header(header::COOKIE, format!("gaitwright_session={secret}"))
            .header(header::CONTENT_TYPE, "application/json")
            .header(header_name, value)
            .body(Body::from(json!({"pseudonym": "S9", "height_m": 1.8, "body_mass_kg": 70}).to_string()))
            .unwrap();
        assert_eq!(service.send(request).await.status, expected, "{header_name}: {value}");
    }
    service.stop().await;
}

#[tokio::test]
async fn every_response_has_the_security_headers() {
    let (_folder, service) = service().await;
    for path in ["/sign-in", "/", "/api/v1/studies", "/static/gaitwright.css", "/nothing"] {
        let answer = send(&service, &As::Nobody, &Method::GET, path, "", "").await;
        for name in [
            "content-security-policy",
            "x-content-type-options",
            "referrer-policy",
            "x-frame-options",
            "cache-control",
            "cross-origin-opener-policy",
            "cross-origin-resource-policy",
            "permissions-policy",
        ] {
            assert!(answer.headers.contains_key(name), "{path}: {name}");
        }
        let policy = answer.headers["content-security-policy"].to_str().unwrap();
        assert!(policy.contains("default-src 'self'") && !policy.contains("unsafe"), "{policy}");
    }
    let large = "x".repeat(2 << 20);
    let admin = signed_in(&service, Role::Administrator).await;
    let answer = send(&service, &admin, &Method::POST, "/api/v1/subjects", "application/json", &large).await;
    assert_eq!(answer.status, StatusCode::PAYLOAD_TOO_LARGE);
    service.stop().await;
}

#[tokio::test]
async fn parallel_guesses_are_limited_like_sequential_ones() {
    let (_folder, service) = service().await;
    let (_, _) = user(&service, "Ada", Role::Administrator).await;
    let guess = |number: u32| {
        let service = &service;
        async move { service.post_text("/sign-in", FORM, &format!("name=Ada&password=guess+{number}")).await.status }
    };
    let statuses = join_all((0..30).map(guess)).await;
    let looked_at = statuses.iter().filter(|status| **status == StatusCode::UNAUTHORIZED).count();
    let refused = statuses.iter().filter(|status| **status == StatusCode::TOO_MANY_REQUESTS).count();
    // Four at once, and one more for every wait that passes meanwhile.
    assert!((4..=7).contains(&looked_at) && looked_at + refused == 30, "{statuses:?}");
}

#[tokio::test]
async fn programs_are_not_redirected_to_the_sign_in_form() {
    let (_folder, service) = service().await;
    let metrics = service.fetch("/metrics").await;
    assert_eq!((metrics.status, metrics.content_type()), (StatusCode::UNAUTHORIZED, "application/problem+json"));
}

#[tokio::test]
async fn users_cannot_have_names_that_look_alike() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let add = async |name: &str| service.post("/api/v1/users", &json!({"name": name, "role": "rater"})).await;
    assert_eq!(add("Dr. Ünal").await.status, StatusCode::CREATED);
    for same in ["dr. ünal", "DR.  ÜNAL", "Dr. U\u{308}nal", "\u{ff24}r. Ünal"] {
        let refused = add(same).await;
        assert_eq!(refused.status, StatusCode::CONFLICT, "{same}");
        assert!(refused.text.contains("A user named"), "{}", refused.text);
    }
    assert_eq!(add("Dr. Unal").await.status, StatusCode::CREATED);
    service.stop().await;
}
