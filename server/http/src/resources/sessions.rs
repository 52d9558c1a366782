//! Sessions of users.

use gaitwright_store::{Instant, SessionId, UserId, sessions};
use serde::Serialize;
use utoipa::ToSchema;

/// Sign-in session of a user.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Session {
    /// Identifier. It is not the value of the session cookie.
    id: SessionId,
    /// Identifier of the user.
    user_id: UserId,
    /// Name of the user.
    user_name: String,
    /// Time of sign-in.
    created_at: Instant,
    /// Time of the last activity.
    seen_at: Instant,
    /// Whether the user signed in with a one-time link rather than a password.
    by_link: bool,
    /// Client address at sign-in. Null if unknown.
    address: Option<String>,
    /// User agent of the browser. Null if unknown.
    browser: Option<String>,
}

impl From<sessions::Session> for Session {
    fn from(row: sessions::Session) -> Self {
        let sessions::Session { id, user_id, user_name, created_at, seen_at, by_link, address, browser } = row;
        Self { id, user_id, user_name, created_at, seen_at, by_link, address, browser }
    }
}
