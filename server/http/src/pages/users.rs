//! The page of users, sessions and tokens.

use crate::AppState;
use crate::authorization::Authorized;
use crate::client_address::Secure;
use crate::extractors::Form;
use crate::format;
use crate::page_error::{PageError, PageResult, page};
use crate::qr_code;
use crate::refused_fields::{FieldLabels, FormCheck, RefusedFields, TypedForm, labels_of};
use askama::Template;
use axum::extract::State;
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use gaitwright_service::access::tokens::{self as making, NewToken};
use gaitwright_service::access::user_administration::{self, NewUser};
use gaitwright_service::access::{Administer, Caller, Right, Role, session};
use gaitwright_service::error::Error;
use gaitwright_store::sessions::Session;
use gaitwright_store::sign_in_failures::NetworkFailures;
use gaitwright_store::tokens::Token;
use gaitwright_store::users::User;
use gaitwright_store::{SessionId, TokenId, UserId, Writer, commit, sessions, sign_in_failures, tokens, users};
use serde::Deserialize;
use std::ops::ControlFlow;
use std::str::FromStr;

/// The scopes of tokens. There is none for administration: only users administer.
const SCOPES: [(Right, &str); 5] = [
    (Right::Read, "see studies, trials and gaits"),
    (Right::Run, "create, start and stop studies; ask for trials and report their results"),
    (Right::Answer, "answer comparisons and review safety reports"),
    (Right::Rate, "compare gaits blind, and record walks and answers of lab sessions"),
    (
        Right::Device,
        "fetch the controller files of walks (for the device in the lab). Give its token no other scope, or its downloads count as not blind",
    ),
];

/// How many networks with failed sign-ins are shown.
const MAX_SOURCES: u32 = 20;

#[derive(Template)]
#[template(path = "users.html")]
struct UsersPage {
    users: Vec<User>,
    tokens: Vec<Token>,
    sessions: Vec<Session>,
    /// Networks with failed sign-ins.
    failures: Vec<NetworkFailures>,
    roles: [Role; 3],
    scopes: [(Right, &'static str); 5],
    outcome: ActionOutcome,
    refused: RefusedFields,
    /// The entries of a refused form. None of them is secret.
    entries: UsersForm,
}

/// The fields of the form that adds a user.
const NEW_USER: FieldLabels = &[("name", "Name or code"), ("role", "Role")];
/// The fields of the form that creates a token.
const NEW_TOKEN: FieldLabels = &[("name", "Purpose"), ("days", "Expires after, days"), ("scopes", "Scopes")];

impl UsersPage {
    /// The attributes of a field of this form. Two forms have a field `name`.
    fn invalid(&self, button: &str, field: &str) -> &'static str {
        if self.entries.button == button { self.refused.invalid(field) } else { "" }
    }

    /// The entry of a field, if its form was the refused one.
    fn entry<'a>(&self, button: &str, text: &'a str) -> &'a str {
        if self.entries.button == button { text } else { "" }
    }

    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn is_role(&self, role: &Role) -> bool {
        let chosen = self.entry("add_user", &self.entries.role);
        role.as_str() == if chosen.is_empty() { "rater" } else { chosen }
    }

    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn is_scope(&self, right: &Right) -> bool {
        if self.entries.button == "make_token" { self.entries.scopes().contains(right) } else { *right == Right::Read }
    }

    fn scopes_of(token: &Token) -> String {
        token.scopes.iter().map(|scope| scope.as_str()).collect::<Vec<_>>().join(", ")
    }
}

/// The result of an action.
#[derive(Default)]
struct ActionOutcome {
    done: Option<String>,
    /// A secret that is shown once: label and text.
    secret: Option<(&'static str, String)>,
}

/// The fields of every form of the page.
#[derive(Debug, Clone, Default, Deserialize)]
pub(super) struct UsersForm {
    button: String,
    #[serde(default)]
    id: String,
    #[serde(default)]
    name: String,
    #[serde(default)]
    role: String,
    #[serde(default)]
    days: String,
    read: Option<String>,
    run: Option<String>,
    answer: Option<String>,
    rate: Option<String>,
    device: Option<String>,
}

impl UsersForm {
    fn scopes(&self) -> Vec<Right> {
        let given: [_; SCOPES.len()] = [&self.read, &self.run, &self.answer, &self.rate, &self.device];
        SCOPES.iter().zip(given).filter(|(_, given)| given.is_some()).map(|((right, _), _)| *right).collect()
    }

    fn role(&self) -> Result<Role, Error> {
        let roles = format!("one of {}", Role::ALL.map(Role::as_str).join(", "));
        self.role.parse().map_err(|_| Error::invalid("role", self.role.as_str(), &roles))
    }

    fn id<T: FromStr>(&self) -> Result<T, Error> {
        self.id.parse().map_err(|_| Error::invalid("id", self.id.as_str(), "an identifier from this page"))
    }
}

impl TypedForm for UsersForm {
    const LABELS: FieldLabels = &[];

    fn labels(&self) -> Vec<(String, String)> {
        labels_of(if self.button == "make_token" { NEW_TOKEN } else { NEW_USER })
    }

    fn repair(&mut self, field: &str) -> bool {
        match field {
            // An unused name.
            "name" => self.name = UserId::fresh().to_string(),
            "role" => Role::Rater.as_str().clone_into(&mut self.role),
            "days" => self.days.clear(),
            "scopes" => self.read = Some("on".to_owned()),
            _ => return false,
        }
        true
    }

    /// The only conflict of a new user or token is a name that is taken.
    fn field_in_conflict(&self) -> Option<&'static str> {
        ["add_user", "make_token"].contains(&self.button.as_str()).then_some("name")
    }
}

/// `GET /users`.
pub(super) async fn get(_: Authorized<Administer>, State(app): State<AppState>) -> PageResult {
    show(&app, ActionOutcome::default(), RefusedFields::default(), UsersForm::default()).await
}

async fn show(app: &AppState, outcome: ActionOutcome, refused: RefusedFields, entries: UsersForm) -> PageResult {
    let mut reader = app.read().await?;
    let (users, tokens) = (users::all(&mut reader).await?, tokens::all(&mut reader).await?);
    let now = app.access.clock.now(&mut reader).await?;
    let sessions = session::live(&mut reader, None, app.access.limits, now).await?;
    let failures = sign_in_failures::most(&mut reader, MAX_SOURCES).await?;
    page(&UsersPage { users, tokens, sessions, failures, roles: Role::ALL, scopes: SCOPES, outcome, refused, entries })
}

/// `POST /users`. Answers with the page instead of a redirect, because a link or token is not stored and can be shown only
/// here.
pub(super) async fn post(
    authorized: Authorized<Administer>,
    State(app): State<AppState>,
    secure: Secure,
    headers: HeaderMap,
    Form(form): Form<UsersForm>,
) -> Result<Response, PageError> {
    let origin = origin(secure, &headers);
    let mut check = FormCheck::new(&form);
    loop {
        let mut writer = app.write().await?;
        let applied = apply(&mut writer, &authorized.caller, &origin, check.form()).await;
        match check.step(applied)? {
            ControlFlow::Continue(()) => {}
            ControlFlow::Break(Some(outcome)) if check.is_clean() => {
                commit(writer).await?;
                // Event streams check again whether their user still has access.
                app.scheduler.changed();
                let shown = show(&app, outcome, RefusedFields::default(), UsersForm::default()).await?;
                return Ok(shown.into_response());
            }
            ControlFlow::Break(_) => break,
        }
    }
    let refused = check.into_refused();
    Ok((refused.status(), show(&app, ActionOutcome::default(), refused, form).await?).into_response())
}

/// The address under which the browser reaches this service, as in `https://gait.clinic.example`. Unknown host names were
/// refused before.
pub(super) fn origin(secure: Secure, headers: &HeaderMap) -> String {
    let host = headers.get(header::HOST).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let scheme = secure.scheme();
    if host.is_empty() { String::new() } else { format!("{scheme}://{host}") }
}

async fn apply(writer: &mut Writer, caller: &Caller, origin: &str, form: &UsersForm) -> Result<ActionOutcome, Error> {
    let actor = &caller.actor;
    let done = |text: String| ActionOutcome { done: Some(text), secret: None };
    match form.button.as_str() {
        "add_user" => {
            let user =
                user_administration::add(writer, actor, &NewUser { name: form.name.clone(), role: form.role()? })
                    .await?;
            let secret = user_administration::link(writer, actor, user.id).await?;
            Ok(link(&user, origin, &secret))
        }
        "link" => {
            let id: UserId = form.id()?;
            let secret = user_administration::link(writer, actor, id).await?;
            Ok(link(&users::get(writer, id).await?, origin, &secret))
        }
        "disable" | "enable" => {
            let disabled = form.button == "disable";
            let user = user_administration::set_disabled(writer, actor, form.id()?, disabled).await?;
            Ok(done(format!("{} is {}.", user.name, if disabled { "disabled" } else { "enabled again" })))
        }
        "role" => {
            let user = user_administration::set_role(writer, actor, form.id()?, form.role()?).await?;
            Ok(done(format!("{} now has the role {}.", user.name, format::role(&user.role))))
        }
        "end_session" => {
            let id: SessionId = form.id()?;
            let missing = || Error::NotFound { what: "sign-in session".to_owned(), id: id.to_string() };
            let session = sessions::get(writer, id).await?.ok_or_else(missing)?;
            session::end(writer, actor, &session).await?;
            Ok(done(format!("Ended a session of {}.", session.user_name)))
        }
        "make_token" => {
            let days = match form.days.trim() {
                "" => None,
                text => Some(text.parse().map_err(|_| Error::invalid("days", text, "1 to 3660, or empty"))?),
            };
            let new = NewToken { name: form.name.clone(), scopes: form.scopes(), days };
            let (token, secret) = making::make(writer, actor, &new).await?;
            Ok(ActionOutcome { done: Some(format!("Created token {}.", token.name)), secret: Some(("Token", secret)) })
        }
        "revoke" => {
            let token = making::revoke(writer, actor, form.id::<TokenId>()?).await?;
            Ok(done(format!("Revoked token {}.", token.name)))
        }
        other => Err(Error::invalid(
            "button",
            other,
            "add_user, link, disable, enable, role, end_session, make_token or revoke",
        )),
    }
}

fn link(user: &User, origin: &str, secret: &str) -> ActionOutcome {
    ActionOutcome {
        done: Some(format!("Created a sign-in link for {}. It works only once and expires after a day.", user.name)),
        secret: Some(("Sign-in link", format!("{origin}/sign-in/{secret}"))),
    }
}
