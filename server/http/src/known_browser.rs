//! Recognises a browser in which a user signed in earlier, from a cookie that outlives the session. The cookie grants no
//! access: only the sign-in back-off uses it.

use super::authentication::cookie_in;
use axum::http::{HeaderMap, HeaderValue};
use gaitwright_service::access::secret;
use gaitwright_service::error::Error;
use gaitwright_store::users::User;
use gaitwright_store::{Connection, UserId, sessions};

/// Name of the cookie.
const BROWSER: &str = "gaitwright_browser";
const BROWSER_SECONDS: u32 = 365 * 24 * 3600;

/// The secret in the cookie of a browser, if it has one.
pub(super) struct BrowserSecret(Option<String>);

impl BrowserSecret {
    pub(super) fn of(headers: &HeaderMap) -> Self {
        Self(cookie_in(headers, BROWSER).map(str::to_owned))
    }

    /// The user, if they signed in with this browser earlier.
    pub(super) async fn recognised(&self, db: &mut Connection, user: Option<&User>) -> Result<Option<UserId>, Error> {
        let (Some(secret), Some(user)) = (&self.0, user) else { return Ok(None) };
        let is_known = sessions::is_known_browser(db, user.id, &secret::hash(secret)).await?;
        Ok(is_known.then_some(user.id))
    }

    /// The secret, or a fresh one for a browser without a cookie.
    pub(super) fn kept_or_fresh(&self) -> Result<String, Error> {
        self.0.clone().map_or_else(secret::fresh, Ok)
    }
}

/// The Set-Cookie header that identifies a browser after sign-out.
pub(super) fn cookie(secret: &str, secure: bool) -> Result<HeaderValue, Error> {
    let secure = if secure { "; Secure" } else { "" };
    let text = format!("{BROWSER}={secret}; Path=/; HttpOnly; SameSite=Lax; Max-Age={BROWSER_SECONDS}{secure}");
    HeaderValue::from_str(&text).map_err(|e| Error::Internal(e.to_string()))
}
