//! Sign-in by a one-time link or a password, which begins a session.

use super::caller::Caller;
use super::{monotonic_clock, secret};
use crate::error::Error;
use gaitwright_store::audit;
use gaitwright_store::sessions::SignInOrigin;
use gaitwright_store::users::{self, User};
use gaitwright_store::{Connection, Writer, sessions};
use serde::Serialize;
use serde_json::json;

/// Time after a sign-in by link in which a password can be set without the current one, which the user may have
/// forgotten.
const LINK_IS_FRESH_SECONDS: f64 = 3600.0;

/// Signs in with a one-time link. Returns the user and the secret of the session.
///
/// # Errors
/// [`Error::NotSignedIn`] if the link is unknown, used or expired, or its user is disabled.
pub async fn with_link(writer: &mut Writer, link: &str) -> Result<(User, String), Error> {
    with_link_from(writer, link, &SignInOrigin::default()).await
}

/// [`with_link`], and records the origin.
///
/// # Errors
/// As [`with_link`]. The caller must commit even then, to record the expiry.
pub async fn with_link_from(writer: &mut Writer, link: &str, from: &SignInOrigin) -> Result<(User, String), Error> {
    let refused = || {
        Error::NotSignedIn(
            "This link was already used or has expired. Ask an administrator for another one.".to_owned(),
        )
    };
    let hash = secret::hash(link);
    let (id, expires_at) = sessions::link(writer, &hash).await?.ok_or_else(refused)?;
    let now = monotonic_clock::recorded(writer).await?;
    let user = users::get(writer, id).await?;
    if expires_at <= now {
        sessions::use_link(writer, &hash, now).await?;
        return Err(refused());
    }
    if user.disabled_at.is_some() {
        return Err(refused());
    }
    sessions::use_link(writer, &hash, now).await?;
    let secret = begin(writer, &user, By::Link, from).await?;
    Ok((user, secret))
}

/// Begins a session after a correct password.
///
/// # Errors
/// Errors of the database.
pub async fn with_password(writer: &mut Writer, user: &User, from: &SignInOrigin) -> Result<String, Error> {
    begin(writer, user, By::Password, from).await
}

/// How a user signed in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum By {
    Link,
    Password,
}

async fn begin(writer: &mut Writer, user: &User, by: By, from: &SignInOrigin) -> Result<String, Error> {
    let secret = renew(writer, user, by == By::Link, from).await?;
    let actor = Caller::person(user.id, &user.name, user.role).actor;
    let detail = json!({ "by": by, "address": from.address });
    audit::append(writer, &actor, "session.begin", &format!("user {}", user.id), &detail).await?;
    Ok(secret)
}

/// A new session after a password change, which ends all others. Part of that entry in the audit trail.
///
/// # Errors
/// Errors of the database.
pub async fn renewed(writer: &mut Writer, user: &User, from: &SignInOrigin) -> Result<String, Error> {
    renew(writer, user, false, from).await
}

async fn renew(writer: &mut Writer, user: &User, by_link: bool, from: &SignInOrigin) -> Result<String, Error> {
    let secret = secret::fresh()?;
    let now = monotonic_clock::recorded(writer).await?;
    sessions::begin(writer, &secret::hash(&secret), user.id, by_link, from, now).await?;
    Ok(secret)
}

/// Whether a user must give the current password to set a new one. Not if there is none, or shortly after a sign-in by
/// link.
///
/// # Errors
/// Errors of the database.
pub async fn must_confirm_password(db: &mut Connection, user: &User, session: Option<&str>) -> Result<bool, Error> {
    if !user.has_password {
        return Ok(false);
    }
    let Some(session) = session else { return Ok(true) };
    let found = sessions::find(db, &secret::hash(session)).await?;
    let now = monotonic_clock::recorded(db).await?;
    let by_fresh_link = found.filter(|session| {
        session.by_link && session.user_id == user.id && now.seconds_since(session.created_at) <= LINK_IS_FRESH_SECONDS
    });
    Ok(by_fresh_link.is_none())
}

/// Whether a signed-in user has no password.
///
/// # Errors
/// Errors of the database.
pub async fn has_no_password(db: &mut Connection, caller: &Caller) -> Result<bool, Error> {
    let Some(id) = caller.user else { return Ok(false) };
    Ok(!users::get(db, id).await?.has_password)
}
