//! Sessions after sign-in: when they expire, who the caller of a session or token is, and how they end.

use super::caller::Caller;
use super::monotonic_clock;
use super::secret;
use crate::error::Error;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::sessions::Session;
use gaitwright_store::{Connection, Instant, SessionId, UserId, Writer, sessions, tokens, users};
use serde_json::json;

/// The least time between two writes of a session's last activity.
const ACTIVITY_INTERVAL_S: f64 = 60.0;

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

/// Signs out: ends the session with this secret.
///
/// # Errors
/// Errors of the database.
pub async fn sign_out(writer: &mut Writer, actor: &Actor, session: &str) -> Result<(), Error> {
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
    let due = now.seconds_since(found.seen_at) > ACTIVITY_INTERVAL_S.min(limits.idle_seconds / 4.0);
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
