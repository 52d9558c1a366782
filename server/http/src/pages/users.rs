//! The page of users, sessions and tokens.

use crate::AppState;
use crate::authorization::Authorized;
use crate::client_address::Secure;
use crate::extractors::Form;
use crate::form_errors;
use crate::format;
use crate::page_error::{PageError, PageResult, page};
use crate::problem_details::Problem;
use crate::qr_code;
use askama::Template;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
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
const MOST_SOURCES: u32 = 20;

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
    refused: Option<RefusedEntry>,
    /// The entries of a refused form. None of them is secret.
    entries: UsersForm,
}

/// Why a form was refused.
struct RefusedEntry {
    /// Which form.
    button: String,
    /// The refused field; `None` if no single field is at fault.
    field: Option<&'static str>,
    message: String,
}

/// The fields of both forms: name, form and label.
const FIELDS: [(&str, &str, &str); 5] = [
    ("name", "add_user", "Name or code"),
    ("role", "add_user", "Role"),
    ("name", "make_token", "Purpose"),
    ("days", "make_token", "Expires after, days"),
    ("scopes", "make_token", "Scopes"),
];

impl RefusedEntry {
    fn of(error: &Error, button: &str) -> Self {
        let find = |name: &str| FIELDS.iter().find(|(field, form, _)| *field == name && *form == button);
        let (field, message) = match error {
            Error::Invalid(fault) => match find(&fault.field) {
                Some((field, _, label)) => (Some(*field), form_errors::of_field(label, fault)),
                None => (None, error.to_string()),
            },
            // The only conflict that these forms can have is a name that is taken.
            Error::Conflict(reason) => (find("name").map(|(field, _, _)| *field), reason.clone()),
            _ => (None, error.to_string()),
        };
        Self { button: button.to_owned(), field, message }
    }
}

impl UsersPage {
    /// Why this field of this form was refused.
    fn fault(&self, button: &str, field: &str) -> Option<&str> {
        let refused = self.refused.as_ref()?;
        (refused.button == button && refused.field == Some(field)).then_some(refused.message.as_str())
    }

    /// The attributes of a refused field.
    fn invalid(&self, button: &str, field: &str) -> &'static str {
        if self.fault(button, field).is_some() {
            " aria-invalid=\"true\" aria-describedby=\"fault\" autofocus"
        } else {
            ""
        }
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
#[derive(Debug, Default, Deserialize)]
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

/// `GET /users`.
pub(super) async fn get(_: Authorized<Administer>, State(app): State<AppState>) -> PageResult {
    show(&app, ActionOutcome::default(), None, UsersForm::default()).await
}

async fn show(app: &AppState, outcome: ActionOutcome, refused: Option<RefusedEntry>, entries: UsersForm) -> PageResult {
    let mut reader = app.read().await?;
    let (users, tokens) = (users::all(&mut reader).await?, tokens::all(&mut reader).await?);
    let now = app.access.clock.now(&mut reader).await?;
    let sessions = session::live(&mut reader, None, app.access.limits, now).await?;
    let failures = sign_in_failures::most(&mut reader, MOST_SOURCES).await?;
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
    let mut writer = app.write().await?;
    let origin = origin(secure, &headers);
    match apply(&mut writer, &authorized.caller, &origin, &form).await {
        Ok(outcome) => {
            commit(writer).await?;
            // Event streams check again whether their user still has access.
            app.scheduler.changed();
            Ok(show(&app, outcome, None, UsersForm::default()).await?.into_response())
        }
        Err(error) if error.is_input() => {
            drop(writer);
            let status = StatusCode::from_u16(Problem::from(&error).status).unwrap_or(StatusCode::BAD_REQUEST);
            let refused = RefusedEntry::of(&error, &form.button);
            Ok((status, show(&app, ActionOutcome::default(), Some(refused), form).await?).into_response())
        }
        Err(error) => Err(error.into()),
    }
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
