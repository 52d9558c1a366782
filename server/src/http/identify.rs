//! Finds out who makes a request, once, before any handler: a token, a session, or nobody.

use super::AppState;
use crate::access::{Caller, Role, sign_in};
use crate::error::Error;
use crate::store::commit;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, header};
use axum::middleware::Next;
use axum::response::Response;

/// Name of the session cookie.
const COOKIE: &str = "gaitwright_session";

/// Whose answer this is, for the pages that errors become.
#[derive(Debug, Clone, Copy)]
pub(super) struct AnsweredTo(pub(super) Option<Role>);

/// Puts the [`Caller`] into the request, and the caller's role into the answer. A token that is not good is refused; a
/// session that is not, is nobody.
pub(super) async fn identify(State(app): State<AppState>, mut request: Request, next: Next) -> Result<Response, Error> {
    let (path, headers) = (request.uri().path().to_owned(), request.headers().clone());
    let mut answered_to = None;
    if let Some(caller) = caller(&app, &path, &headers).await? {
        answered_to = Some(AnsweredTo(caller.role));
        request.extensions_mut().insert(caller);
    }
    let mut answer = next.run(request).await;
    if let Some(to) = answered_to {
        answer.extensions_mut().insert(to);
    }
    Ok(answer)
}

async fn caller(app: &AppState, path: &str, headers: &HeaderMap) -> Result<Option<Caller>, Error> {
    if path.starts_with("/static/") {
        return Ok(None);
    }
    if let Some(token) = bearer(headers)? {
        let found = sign_in::of_token(&mut *app.read().await?, token).await?;
        let refused = || Error::NotSignedIn("this token is unknown, has ended or was revoked".to_owned());
        return found.map(Some).ok_or_else(refused);
    }
    if let Some(session) = session_of(headers) {
        let found = sign_in::of_session(&mut *app.read().await?, session, app.access.idle_seconds).await?;
        if let Some((caller, note)) = found {
            // What a page asks for by itself keeps nobody signed in.
            if note && !path.ends_with("/live") && !path.ends_with("/events") {
                let mut writer = app.write().await?;
                sign_in::seen(&mut writer, session).await?;
                commit(writer).await?;
            }
            return Ok(Some(caller));
        }
    }
    Ok(app.access.open.then(Caller::without_sign_in))
}

fn bearer(headers: &HeaderMap) -> Result<Option<&str>, Error> {
    let Some(value) = headers.get(header::AUTHORIZATION) else { return Ok(None) };
    let token = value.to_str().ok().and_then(|text| text.split_once(' '));
    match token {
        Some((scheme, token)) if scheme.eq_ignore_ascii_case("bearer") => Ok(Some(token.trim())),
        _ => Err(Error::NotSignedIn("Authorization: a bearer token is expected".to_owned())),
    }
}

/// The secret of the session in the cookie.
pub(super) fn session_of(headers: &HeaderMap) -> Option<&str> {
    let cookies = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
    let mut pairs = cookies.flat_map(|text| text.split(';')).filter_map(|pair| pair.trim().split_once('='));
    pairs.find_map(|(name, value)| (name == COOKIE && !value.is_empty()).then_some(value))
}

/// The header that gives a browser its session, or takes it away. Scripts cannot read it, other sites cannot use it.
pub(super) fn cookie(session: Option<&str>, secure: bool) -> Result<HeaderValue, Error> {
    let secure = if secure { "; Secure" } else { "" };
    let text = match session {
        Some(secret) => format!("{COOKIE}={secret}; Path=/; HttpOnly; SameSite=Lax{secure}"),
        None => format!("{COOKIE}=; Path=/; HttpOnly; SameSite=Lax; Max-Age=0{secure}"),
    };
    HeaderValue::from_str(&text).map_err(|e| Error::Internal(e.to_string()))
}
