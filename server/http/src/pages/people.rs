//! Users and tokens: who may come in.

use super::error::{Page, PageError, page};
use crate::AppState;
use crate::client_address::Secure;
use crate::extract::Form;
use crate::may::May;
use crate::problem::Problem;
use askama::Template;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use gaitwright_service::access::people::{self, NewUser};
use gaitwright_service::access::tokens::{self as making, NewToken};
use gaitwright_service::access::{Administer, Caller, Right, Role, sign_in};
use gaitwright_service::error::{Error, FieldError};
use gaitwright_store::sessions::Session;
use gaitwright_store::sign_in_failures::Source;
use gaitwright_store::tokens::Token;
use gaitwright_store::users::User;
use gaitwright_store::{SessionId, TokenId, UserId, Writer, commit, sessions, sign_in_failures, tokens, users};
use serde::Deserialize;
use serde_json::Value;
use std::str::FromStr;

/// What a token may be allowed: people administer, programs do not.
const SCOPES: [(Right, &str); 5] = [
    (Right::Read, "see studies, trials and gaits"),
    (Right::Run, "make, start and end studies; ask for trials and tell what they gave"),
    (Right::Answer, "say which gait is better, and decide about unsafe ones"),
    (Right::Rate, "compare gaits blindly"),
    (Right::Device, "the device in the lab: fetch the controller files of walks (give it nothing else)"),
];

/// Networks with failed sign-ins that are shown.
const MOST_SOURCES: u32 = 20;

#[derive(Template)]
#[template(path = "people.html")]
struct PeoplePage {
    users: Vec<User>,
    tokens: Vec<Token>,
    sessions: Vec<Session>,
    /// Networks with failed sign-ins.
    failures: Vec<Source>,
    roles: [Role; 3],
    scopes: [(Right, &'static str); 5],
    outcome: Outcome,
    refused: Option<Refused>,
    /// A refused form as it was typed. There is no secret in it.
    typed: Asked,
}

/// Why a form was refused.
struct Refused {
    /// Which form.
    act: String,
    /// Which field; none: not because of one.
    field: Option<&'static str>,
    message: String,
}

/// The fields of both forms: name in the record, form, and what people read beside it.
const FIELDS: [(&str, &str, &str); 5] = [
    ("name", "add_user", "Name or code"),
    ("role", "add_user", "Role"),
    ("name", "make_token", "What it is for"),
    ("days", "make_token", "Ends after, days"),
    ("scopes", "make_token", "What it allows"),
];

impl Refused {
    fn of(error: &Error, act: &str) -> Self {
        let find = |name: &str| FIELDS.iter().find(|(field, form, _)| *field == name && *form == act);
        let (field, message) = match error {
            Error::Invalid(fault) => match find(&fault.field) {
                Some((field, _, label)) => (Some(*field), in_words(label, fault)),
                None => (None, error.to_string()),
            },
            // A name that is taken is all that the present state has against these two.
            Error::Conflict(reason) => (find("name").map(|(field, _, _)| *field), reason.clone()),
            _ => (None, error.to_string()),
        };
        Self { act: act.to_owned(), field, message }
    }
}

/// What is wrong with a field, under the name that people read.
fn in_words(label: &str, fault: &FieldError) -> String {
    let allowed = fault.allowed.as_deref().unwrap_or_default();
    match fault.value.as_ref() {
        Some(Value::String(text)) if !text.is_empty() => {
            format!("{label}: \u{201c}{text}\u{201d} is not accepted; accepted: {allowed}")
        }
        Some(Value::Number(number)) => format!("{label}: {number} is not accepted; accepted: {allowed}"),
        _ => format!("{label}: needed is {allowed}"),
    }
}

impl PeoplePage {
    /// Why this field of this form was refused.
    fn fault(&self, act: &str, field: &str) -> Option<&str> {
        let refused = self.refused.as_ref()?;
        (refused.act == act && refused.field == Some(field)).then_some(refused.message.as_str())
    }

    /// What marks a refused field.
    fn invalid(&self, act: &str, field: &str) -> &'static str {
        if self.fault(act, field).is_some() {
            " aria-invalid=\"true\" aria-describedby=\"fault\" autofocus"
        } else {
            ""
        }
    }

    /// What was typed into a form, if it was that one.
    fn typed<'a>(&self, act: &str, text: &'a str) -> &'a str {
        if self.typed.act == act { text } else { "" }
    }

    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn is_role(&self, role: &Role) -> bool {
        let chosen = self.typed("add_user", &self.typed.role);
        role.as_str() == if chosen.is_empty() { "rater" } else { chosen }
    }

    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn is_scope(&self, right: &Right) -> bool {
        if self.typed.act == "make_token" { self.typed.scopes().contains(right) } else { *right == Right::Read }
    }

    fn scopes_of(token: &Token) -> String {
        token.scopes.iter().map(|scope| scope.as_str()).collect::<Vec<_>>().join(", ")
    }
}

/// What was just done.
#[derive(Default)]
struct Outcome {
    done: Option<String>,
    /// Something that is shown once and never again: what it is, and itself.
    secret: Option<(&'static str, String)>,
}

/// What a form asks for.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Asked {
    act: String,
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
}

impl Asked {
    fn scopes(&self) -> Vec<Right> {
        let given = [&self.read, &self.run, &self.answer, &self.rate];
        SCOPES.iter().zip(given).filter(|(_, given)| given.is_some()).map(|((right, _), _)| *right).collect()
    }

    fn role(&self) -> Result<Role, Error> {
        let roles = Role::ALL.map(Role::as_str).join(", ");
        self.role.parse().map_err(|_| Error::invalid("role", self.role.as_str(), &roles))
    }

    fn id<T: FromStr>(&self) -> Result<T, Error> {
        self.id.parse().map_err(|_| Error::invalid("id", self.id.as_str(), "an identifier of this page"))
    }
}

/// `GET /people`.
pub(super) async fn get(_: May<Administer>, State(app): State<AppState>) -> Page {
    show(&app, Outcome::default(), None, Asked::default()).await
}

async fn show(app: &AppState, outcome: Outcome, refused: Option<Refused>, typed: Asked) -> Page {
    let mut reader = app.read().await?;
    let (users, tokens) = (users::all(&mut reader).await?, tokens::all(&mut reader).await?);
    let now = app.access.clock.now(&mut reader).await?;
    let sessions = sign_in::live(&mut reader, None, app.access.limits, now).await?;
    let failures = sign_in_failures::most(&mut reader, MOST_SOURCES).await?;
    page(&PeoplePage { users, tokens, sessions, failures, roles: Role::ALL, scopes: SCOPES, outcome, refused, typed })
}

/// `POST /people`. A link or token is in the answer itself: it is not stored, and a reload does not make another one
/// without asking.
pub(super) async fn post(
    may: May<Administer>,
    State(app): State<AppState>,
    secure: Secure,
    headers: HeaderMap,
    Form(asked): Form<Asked>,
) -> Result<Response, PageError> {
    let mut writer = app.write().await?;
    let origin = origin(secure, &headers);
    match act(&mut writer, &may.caller, &origin, &asked).await {
        Ok(outcome) => {
            commit(writer).await?;
            // Event streams of whoever may no more are listening to nothing else.
            app.scheduler.changed();
            Ok(show(&app, outcome, None, Asked::default()).await?.into_response())
        }
        Err(error) if error.is_input() => {
            drop(writer);
            let status = StatusCode::from_u16(Problem::from(&error).status).unwrap_or(StatusCode::BAD_REQUEST);
            let refused = Refused::of(&error, &asked.act);
            Ok((status, show(&app, Outcome::default(), Some(refused), asked).await?).into_response())
        }
        Err(error) => Err(error.into()),
    }
}

/// Where the asking browser reaches this service: `https://gait.clinic.example`. Other names are refused before.
pub(super) fn origin(secure: Secure, headers: &HeaderMap) -> String {
    let host = headers.get(header::HOST).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let scheme = secure.scheme();
    if host.is_empty() { String::new() } else { format!("{scheme}://{host}") }
}

async fn act(writer: &mut Writer, caller: &Caller, origin: &str, asked: &Asked) -> Result<Outcome, Error> {
    let actor = &caller.actor;
    let done = |text: String| Outcome { done: Some(text), secret: None };
    match asked.act.as_str() {
        "add_user" => {
            let user = people::add(writer, actor, &NewUser { name: asked.name.clone(), role: asked.role()? }).await?;
            let secret = people::link(writer, actor, user.id).await?;
            Ok(link(&user, origin, &secret))
        }
        "link" => {
            let id: UserId = asked.id()?;
            let secret = people::link(writer, actor, id).await?;
            Ok(link(&users::get(writer, id).await?, origin, &secret))
        }
        "disable" | "enable" => {
            let disabled = asked.act == "disable";
            let user = people::set_disabled(writer, actor, asked.id()?, disabled).await?;
            Ok(done(format!("{} is {}.", user.name, if disabled { "shut out" } else { "let in again" })))
        }
        "role" => {
            let user = people::set_role(writer, actor, asked.id()?, asked.role()?).await?;
            Ok(done(format!("{} is {} from now on.", user.name, user.role.as_str())))
        }
        "end_session" => {
            let id: SessionId = asked.id()?;
            let missing = || Error::NotFound { what: "session".to_owned(), id: id.to_string() };
            let session = sessions::get(writer, id).await?.ok_or_else(missing)?;
            sign_in::end(writer, actor, &session).await?;
            Ok(done(format!("A session of {} was ended.", session.user_name)))
        }
        "make_token" => {
            let days = match asked.days.trim() {
                "" => None,
                text => Some(text.parse().map_err(|_| Error::invalid("days", text, "1 to 3660, or nothing"))?),
            };
            let new = NewToken { name: asked.name.clone(), scopes: asked.scopes(), days };
            let (token, secret) = making::make(writer, actor, &new).await?;
            Ok(Outcome { done: Some(format!("Token {} was made.", token.name)), secret: Some(("Token", secret)) })
        }
        "revoke" => {
            let token = making::revoke(writer, actor, asked.id::<TokenId>()?).await?;
            Ok(done(format!("Token {} was ended.", token.name)))
        }
        other => {
            Err(Error::invalid("act", other, "add_user, link, disable, enable, role, end_session, make_token, revoke"))
        }
    }
}

fn link(user: &User, origin: &str, secret: &str) -> Outcome {
    Outcome {
        done: Some(format!("A sign-in link for {}: it works once, within a day. Send it to them.", user.name)),
        secret: Some(("The link", format!("{origin}/sign-in/{secret}"))),
    }
}
