//! Sessions: sign-in, sign-out, expiry, and the caller of a session or token.

use super::caller::Caller;
use super::{monotonic_clock, secret};
use crate::error::Error;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::sessions::{Session, SignInOrigin};
use gaitwright_store::users::{self, User};
use gaitwright_store::{Connection, Instant, SessionId, UserId, Writer, sessions, tokens};
use serde::Serialize;
use serde_json::json;

/// The least time between two writes of a session's last activity.
const SEEN_EVERY_SECONDS: f64 = 60.0;

/// Time after a sign-in by link in which a password can be set without the current one, which the user may have
/// forgotten.
const LINK_IS_FRESH_SECONDS: f64 = 3600.0;

/// When sessions expire.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SessionLimits {
    /// Time without a request after which a session expires.
    pub idle_seconds: f64,
    /// Time after which a session expires in any case.
    pub lifetime_seconds: f64,
}

impl SessionLimits {
    fn has_ended(&self, session: &Session, now: Instant) -> bool {
        now.seconds_since(session.seen_at) > self.idle_seconds
            || now.seconds_since(session.created_at) > self.lifetime_seconds
    }
}

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

/// Signs out: ends the session with this secret.
///
/// # Errors
/// Errors of the database.
pub async fn out(writer: &mut Writer, actor: &Actor, session: &str) -> Result<(), Error> {
    if let Some(session) = sessions::find(writer, &secret::hash(session)).await? {
        end(writer, actor, &session).await?;
    }
    Ok(())
}

/// Ends a session of the caller, or of any user if the caller is an administrator.
///
/// # Errors
/// Errors of the database.
pub async fn end(writer: &mut Writer, actor: &Actor, session: &Session) -> Result<(), Error> {
    let now = monotonic_clock::recorded(writer).await?;
    if sessions::end(writer, session.id, now).await? {
        let detail = json!({ "session": session.id });
        audit::append(writer, actor, "session.end", &format!("user {}", session.user_id), &detail).await?;
    }
    Ok(())
}

/// The active sessions of a user or of all users, newest first.
///
/// # Errors
/// Errors of the database.
pub async fn live(
    db: &mut Connection,
    user: Option<UserId>,
    limits: SessionLimits,
    now: Instant,
) -> Result<Vec<Session>, Error> {
    let mut found = sessions::live(db, user).await?;
    found.retain(|session| !limits.has_ended(session, now));
    Ok(found)
}

/// The result of looking up a secret.
#[derive(Debug)]
pub enum SignInLookup {
    /// The secret is unknown, or was ended.
    Nobody,
    /// The session or token has expired, which must be recorded with [`record_expiry`].
    Ended(Option<SessionId>),
    /// The secret is valid.
    Known {
        /// The caller.
        caller: Caller,
        /// The session, if its last activity must be recorded.
        seen: Option<SessionId>,
    },
}

/// Looks up the secret of a session.
///
/// # Errors
/// Errors of the database.
pub async fn of_session(
    db: &mut Connection,
    session: &str,
    limits: SessionLimits,
    now: Instant,
) -> Result<SignInLookup, Error> {
    let Some(found) = sessions::find(db, &secret::hash(session)).await? else { return Ok(SignInLookup::Nobody) };
    if limits.has_ended(&found, now) {
        return Ok(SignInLookup::Ended(Some(found.id)));
    }
    let user = users::get(db, found.user_id).await?;
    if user.disabled_at.is_some() {
        return Ok(SignInLookup::Nobody);
    }
    let due = now.seconds_since(found.seen_at) > SEEN_EVERY_SECONDS.min(limits.idle_seconds / 4.0);
    Ok(SignInLookup::Known { caller: Caller::person(user.id, &user.name, user.role), seen: due.then_some(found.id) })
}

/// Looks up the secret of a token.
///
/// # Errors
/// Errors of the database.
pub async fn of_token(db: &mut Connection, token: &str, now: Instant) -> Result<SignInLookup, Error> {
    let Some(found) = tokens::by_hash(db, &secret::hash(token)).await? else { return Ok(SignInLookup::Nobody) };
    if let Some(expires_at) = found.expires_at.filter(|expires_at| *expires_at <= now) {
        let is_recorded = gaitwright_store::access_clock::latest(db).await?.is_some_and(|latest| latest >= expires_at);
        return Ok(if is_recorded { SignInLookup::Nobody } else { SignInLookup::Ended(None) });
    }
    Ok(SignInLookup::Known { caller: Caller::token(found.id, &found.name, &found.scopes), seen: None })
}

/// Records the last activity of a session.
///
/// # Errors
/// Errors of the database.
pub async fn record_activity(writer: &mut Writer, session: SessionId, now: Instant) -> Result<(), Error> {
    gaitwright_store::access_clock::reach(writer, now).await?;
    Ok(sessions::record_activity(writer, session, now).await?)
}

/// Records that a session or token has expired, so that it stays expired when the machine's clock is set back.
///
/// # Errors
/// Errors of the database.
pub async fn record_expiry(writer: &mut Writer, session: Option<SessionId>, now: Instant) -> Result<(), Error> {
    gaitwright_store::access_clock::reach(writer, now).await?;
    if let Some(session) = session {
        sessions::end(writer, session, now).await?;
    }
    Ok(())
}
