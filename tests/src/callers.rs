//! Callers of requests: users of every role, tokens, and anonymous callers.

use crate::analytic::Analytic;
use crate::service::{Answer, Service};
use axum::body::Body;
use axum::extract::ConnectInfo;
use axum::http::request::Builder;
use axum::http::{Method, Request, header};
use gaitwright_http::AccessState;
use gaitwright_service::access::tokens::{self, NewToken};
use gaitwright_service::access::user_administration::{self, NewUser};
use gaitwright_service::access::{Right, Role, secret, sign_in};
use gaitwright_service::studies::membership::{self, NewMember};
use gaitwright_store::audit::Actor;
use gaitwright_store::members::{Member, MemberKind};
use gaitwright_store::{StudyId, UserId, commit};
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use tempfile::TempDir;

/// Content type of a submitted form.
pub const FORM: &str = "application/x-www-form-urlencoded";

/// A service that requires sign-in.
pub async fn service() -> (TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let mut service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    service.access = Arc::new(AccessState::by_sign_in(3600.0));
    (folder, service)
}

/// How a request identifies its caller.
#[derive(Debug, Clone)]
pub enum As {
    /// Without a word.
    Nobody,
    /// A browser that was signed in: the secret of its session.
    Session(String),
    /// A program: its token.
    Token(String),
}

/// A user and their one-time sign-in link.
pub async fn user(service: &Service, name: &str, role: Role) -> (UserId, String) {
    let mut writer = service.store.write().await.unwrap();
    let new = NewUser { name: name.to_owned(), role };
    let user = user_administration::add(&mut writer, &Actor::program(), &new).await.unwrap();
    let link = user_administration::link(&mut writer, &Actor::program(), user.id).await.unwrap();
    commit(writer).await.unwrap();
    (user.id, link)
}

/// A user of a role, signed in.
pub async fn signed_in(service: &Service, role: Role) -> As {
    let (_, link) = user(service, &format!("a {}", role.as_str()), role).await;
    let mut writer = service.store.write().await.unwrap();
    let (_, session) = sign_in::with_link(&mut writer, &link).await.unwrap();
    commit(writer).await.unwrap();
    As::Session(session)
}

/// A token with these scopes.
pub async fn token(service: &Service, scopes: &[Right]) -> As {
    let mut writer = service.store.write().await.unwrap();
    let new = NewToken { name: format!("{scopes:?}"), scopes: scopes.to_vec(), days: Some(1) };
    let (_, secret) = tokens::make(&mut writer, &Actor::program(), &new).await.unwrap();
    commit(writer).await.unwrap();
    As::Token(secret)
}

/// Adds a user or a token to the members of a study.
pub async fn member(service: &Service, study: StudyId, kind: MemberKind, name: &str) -> Member {
    let mut writer = service.store.write().await.unwrap();
    let new = NewMember { kind, name: name.to_owned() };
    let member = membership::add(&mut writer, &Actor::program(), study, &new).await.unwrap();
    commit(writer).await.unwrap();
    member
}

/// A rater who is assigned to these studies, signed in.
pub async fn rater_of(service: &Service, studies: &[StudyId]) -> As {
    let rater = signed_in(service, Role::Rater).await;
    for study in studies {
        member(service, *study, MemberKind::User, "a rater").await;
    }
    rater
}

/// Sends a request as a caller.
pub async fn send(service: &Service, who: &As, method: &Method, path: &str, kind: &str, body: &str) -> Answer {
    let request = Request::builder().method(method).uri(path).header(header::CONTENT_TYPE, kind);
    service.send(of(who, request).body(Body::from(body.to_owned())).unwrap()).await
}

/// Fetches an address as a caller, in one of its media types.
pub async fn send_accepting(service: &Service, who: &As, path: &str, form: &str) -> Answer {
    let request = Request::builder().uri(path).header(header::ACCEPT, form);
    service.send(of(who, request).body(Body::empty()).unwrap()).await
}

/// Adds the credential of a caller to a request.
pub fn of(who: &As, request: Builder) -> Builder {
    match who {
        As::Nobody => request,
        As::Session(secret) => request
            .header(header::COOKIE, format!("gaitwright_session={secret}"))
            .header("sec-fetch-site", "same-origin"),
        As::Token(secret) => request.header(header::AUTHORIZATION, format!("Bearer {secret}")),
    }
}

/// The session that a response starts.
pub fn session_of(answer: &Answer) -> As {
    As::Session(cookie_of(answer, "gaitwright_session"))
}

/// The value of a cookie that an answer sets.
pub fn cookie_of(answer: &Answer, name: &str) -> String {
    let mut cookies = answer.headers.get_all("set-cookie").iter().map(|cookie| cookie.to_str().unwrap());
    let start = format!("{name}=");
    let cookie = cookies.find(|cookie| cookie.starts_with(&start)).unwrap();
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Lax"), "{cookie}");
    cookie[start.len()..].split(';').next().unwrap().to_owned()
}

/// Sends name and password from an address, in a browser that may have been there before.
pub async fn sign_in_from(
    service: &Service,
    address: impl Into<IpAddr>,
    browser: Option<&str>,
    name: &str,
    password: &str,
) -> Answer {
    let mut request = Request::post("/sign-in").header(header::CONTENT_TYPE, FORM);
    if let Some(browser) = browser {
        request = request
            .header(header::COOKIE, format!("gaitwright_browser={browser}"))
            .header("sec-fetch-site", "same-origin");
    }
    let body = format!("name={}&password={}", name.replace(' ', "+"), password.replace(' ', "+"));
    let mut request = request.body(Body::from(body)).unwrap();
    request.extensions_mut().insert(ConnectInfo(SocketAddr::new(address.into(), 40_000)));
    service.send(request).await
}

/// A user with a password.
pub async fn with_password(service: &Service, name: &str, role: Role, password: &str) -> UserId {
    let (id, _) = user(service, name, role).await;
    let hashed = secret::hash_password_of(name, password).unwrap();
    let mut writer = service.store.write().await.unwrap();
    user_administration::set_password(&mut writer, &Actor::program(), id, &hashed).await.unwrap();
    commit(writer).await.unwrap();
    id
}
