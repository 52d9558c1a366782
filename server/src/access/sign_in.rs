//! Signing in and out, and recognising who was signed in.

use super::caller::Caller;
use super::secret;
use crate::error::Error;
use crate::store::audit::{self, Actor};
use crate::store::users::{self, User};
use crate::store::{Connection, Writer, now, sessions, tokens};
use serde::Serialize;
use serde_json::json;

/// An instant at which the person did something is written at most this often.
const SEEN_EVERY_SECONDS: f64 = 60.0;

/// For so long after coming in by a one-time link a password can be set without the present one, which may be forgotten.
const LINK_IS_FRESH_SECONDS: f64 = 3600.0;

/// Signs in with a one-time link: the user and the secret of the session.
///
/// # Errors
/// [`Error::NotSignedIn`] when the link is unknown, used, too old, or of a user who was shut out.
pub async fn with_link(writer: &mut Writer, link: &str) -> Result<(User, String), Error> {
    let refused = || Error::NotSignedIn("this link was used or is too old; ask for another one".to_owned());
    let hash = secret::hash(link);
    let id = sessions::link(writer, &hash).await?.ok_or_else(refused)?;
    let user = users::get(writer, id).await?;
    if user.disabled_at.is_some() {
        return Err(refused());
    }
    sessions::use_link(writer, &hash).await?;
    let secret = begin(writer, &user, By::Link).await?;
    Ok((user, secret))
}

/// Begins a session of a user whose password was found right.
///
/// # Errors
/// What the database reports.
pub async fn with_password(writer: &mut Writer, user: &User) -> Result<String, Error> {
    begin(writer, user, By::Password).await
}

/// What somebody came in by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum By {
    Link,
    Password,
}

async fn begin(writer: &mut Writer, user: &User, by: By) -> Result<String, Error> {
    let secret = secret::fresh()?;
    sessions::begin(writer, &secret::hash(&secret), user.id, by == By::Link).await?;
    let actor = Caller::person(user.id, &user.name, user.role).actor;
    audit::append(writer, &actor, "session.begin", &format!("user {}", user.id), &json!({ "by": by })).await?;
    Ok(secret)
}

/// A session in place of those that ended when the user set a password; part of that act in the audit trail.
///
/// # Errors
/// What the database reports.
pub async fn renew(writer: &mut Writer, user: &User) -> Result<String, Error> {
    let secret = secret::fresh()?;
    sessions::begin(writer, &secret::hash(&secret), user.id, false).await?;
    Ok(secret)
}

/// Whether a user must say the present password to set another one: unless there is none, or a one-time link has just let
/// the user in.
///
/// # Errors
/// What the database reports.
pub async fn must_say_password(db: &mut Connection, user: &User, session: Option<&str>) -> Result<bool, Error> {
    if !user.has_password {
        return Ok(false);
    }
    let Some(session) = session else { return Ok(true) };
    let found = sessions::find(db, &secret::hash(session)).await?;
    let by_fresh_link = found.filter(|session| {
        session.by_link && session.user == user.id && now().seconds_since(session.begun_at) <= LINK_IS_FRESH_SECONDS
    });
    Ok(by_fresh_link.is_none())
}

/// Whether somebody who is signed in has no way in but a one-time link.
///
/// # Errors
/// What the database reports.
pub async fn has_no_password(db: &mut Connection, caller: &Caller) -> Result<bool, Error> {
    let Some(id) = caller.user else { return Ok(false) };
    Ok(!users::get(db, id).await?.has_password)
}

/// Notes a failed attempt with a password.
///
/// # Errors
/// What the database reports.
pub async fn failed(writer: &mut Writer, name: &str) -> Result<(), Error> {
    let name: String = name.chars().filter(|c| !c.is_control()).take(80).collect();
    audit::append(writer, &Actor::anonymous(), "session.refuse", "session", &json!({ "name": name })).await?;
    Ok(())
}

/// Signs out.
///
/// # Errors
/// What the database reports.
pub async fn out(writer: &mut Writer, actor: &Actor, session: &str) -> Result<(), Error> {
    sessions::end(writer, &secret::hash(session)).await?;
    audit::append(writer, actor, "session.end", "session", &json!({})).await?;
    Ok(())
}

/// Whose session it is, and whether it is time to note that the person did something.
///
/// # Errors
/// What the database reports.
pub async fn of_session(db: &mut Connection, session: &str, idle: f64) -> Result<Option<(Caller, bool)>, Error> {
    let Some(found) = sessions::find(db, &secret::hash(session)).await? else { return Ok(None) };
    let since = now().seconds_since(found.seen_at);
    if since > idle {
        return Ok(None);
    }
    let user = users::get(db, found.user).await?;
    if user.disabled_at.is_some() {
        return Ok(None);
    }
    Ok(Some((Caller::person(user.id, &user.name, user.role), since > SEEN_EVERY_SECONDS.min(idle / 4.0))))
}

/// Notes that the person did something.
///
/// # Errors
/// What the database reports.
pub async fn seen(writer: &mut Writer, session: &str) -> Result<(), Error> {
    Ok(sessions::seen(writer, &secret::hash(session)).await?)
}

/// Whose token it is.
///
/// # Errors
/// What the database reports.
pub async fn of_token(db: &mut Connection, token: &str) -> Result<Option<Caller>, Error> {
    let found = tokens::by_hash(db, &secret::hash(token)).await?;
    Ok(found.map(|token| Caller::token(token.id, &token.name, &token.scopes)))
}
