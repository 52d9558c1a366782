//! Authentication: finds the caller of a request from its token or session cookie, before any handler.

use super::{AppState, request_body};
use crate::error_page_reader::RespondedTo;
use crate::problem_details::Refusal;
use axum::body::HttpBody;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use gaitwright_service::access::Caller;
use gaitwright_service::access::session::{self, SignInLookup};
use gaitwright_service::error::Error;
use gaitwright_store::{Instant, commit};

/// Name of the session cookie.
const COOKIE: &str = "gaitwright_session";

/// Receives the request, adds its [`Caller`], and the caller's role to the response. Refuses an invalid token; ignores an
/// invalid session. The caller is looked up again after a body was received, because rights can end while it arrives.
pub(super) async fn identify(State(app): State<AppState>, request: Request, next: Next) -> Result<Response, Refusal> {
    let (path, headers) = (request.uri().path().to_owned(), request.headers().clone());
    let mut found = caller(&app, &path, &headers).await?;
    let has_body = !request.body().is_end_stream();
    let limit = request_body::limit(&request, found.is_some());
    let received = request_body::receive(request, limit).await;
    if has_body {
        found = caller(&app, &path, &headers).await?;
    }
    let to = found.as_ref().map(|caller| RespondedTo(caller.role));
    let mut response = match received {
        Ok(mut request) => {
            if let Some(caller) = found {
                request.extensions_mut().insert(caller);
            }
            next.run(request).await
        }
        Err(error) => Refusal(error).into_response(),
    };
    if let Some(to) = to {
        response.extensions_mut().insert(to);
    }
    Ok(response)
}

async fn caller(app: &AppState, path: &str, headers: &HeaderMap) -> Result<Option<Caller>, Error> {
    if path.starts_with("/static/") {
        return Ok(None);
    }
    let credential = Credential::of(headers)?;
    if matches!(credential, Credential::None) {
        return Ok(app.access.open.then(Caller::without_sign_in));
    }
    match credential.recognise(app).await? {
        (SignInLookup::Known { caller, seen }, now) => {
            // Automatic requests of a page do not keep a session alive.
            if let Some(session) = seen.filter(|_| !path.ends_with("/live") && !path.ends_with("/events")) {
                let mut writer = app.write().await?;
                session::record_activity(&mut writer, session, now).await?;
                commit(writer).await?;
            }
            return Ok(Some(caller));
        }
        (SignInLookup::Ended(session), now) => {
            let mut writer = app.write().await?;
            session::record_expiry(&mut writer, session, now).await?;
            commit(writer).await?;
        }
        (SignInLookup::Nobody, _) => {}
    }
    match credential {
        Credential::Token(_) => Err(Error::NotSignedIn(
            "The token is unknown, expired or revoked. Ask an administrator for a new one.".to_owned(),
        )),
        Credential::Session(_) | Credential::None => Ok(app.access.open.then(Caller::without_sign_in)),
    }
}

/// The credential of a request.
#[derive(Clone)]
pub(super) enum Credential {
    Token(String),
    Session(String),
    None,
}

impl Credential {
    pub(super) fn of(headers: &HeaderMap) -> Result<Self, Error> {
        if let Some(token) = bearer(headers)? {
            return Ok(Self::Token(token.to_owned()));
        }
        Ok(session_of(headers).map_or(Self::None, |session| Self::Session(session.to_owned())))
    }

    /// Looks up the credential. Returns the result and the time of the decision, and writes nothing.
    async fn recognise(&self, app: &AppState) -> Result<(SignInLookup, Instant), Error> {
        let mut reader = app.read().await?;
        let now = app.access.clock.now(&mut reader).await?;
        let found = match self {
            Self::Token(token) => session::of_token(&mut reader, token, now).await?,
            Self::Session(session) => session::of_session(&mut reader, session, app.access.limits, now).await?,
            Self::None => SignInLookup::Nobody,
        };
        Ok((found, now))
    }

    /// Looks up the caller again, for streams that outlive their request.
    pub(super) async fn caller(&self, app: &AppState) -> Result<Option<Caller>, Error> {
        Ok(match self.recognise(app).await?.0 {
            SignInLookup::Known { caller, .. } => Some(caller),
            SignInLookup::Ended(_) | SignInLookup::Nobody => match self {
                Self::Token(_) => None,
                Self::Session(_) | Self::None => app.access.open.then(Caller::without_sign_in),
            },
        })
    }
}

fn bearer(headers: &HeaderMap) -> Result<Option<&str>, Error> {
    let Some(value) = headers.get(header::AUTHORIZATION) else { return Ok(None) };
    let token = value.to_str().ok().and_then(|text| text.split_once(' '));
    match token {
        Some((scheme, token)) if scheme.eq_ignore_ascii_case("bearer") => Ok(Some(token.trim())),
        _ => Err(Error::NotSignedIn("The Authorization header must have the form `Bearer TOKEN`.".to_owned())),
    }
}

/// The secret of the session in the cookie.
pub(super) fn session_of(headers: &HeaderMap) -> Option<&str> {
    cookie_in(headers, COOKIE)
}

/// The value of a cookie.
pub(super) fn cookie_in<'a>(headers: &'a HeaderMap, wanted: &str) -> Option<&'a str> {
    let cookies = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
    let mut pairs = cookies.flat_map(|text| text.split(';')).filter_map(|pair| pair.trim().split_once('='));
    pairs.find_map(|(name, value)| (name == wanted && !value.is_empty()).then_some(value))
}

/// The Set-Cookie header that sets or clears the session. Scripts cannot read the cookie, and other sites cannot use
/// it.
pub(super) fn cookie(session: Option<&str>, secure: bool) -> Result<HeaderValue, Error> {
    let secure = if secure { "; Secure" } else { "" };
    let text = match session {
        Some(secret) => format!("{COOKIE}={secret}; Path=/; HttpOnly; SameSite=Lax{secure}"),
        None => format!("{COOKIE}=; Path=/; HttpOnly; SameSite=Lax; Max-Age=0{secure}"),
    };
    HeaderValue::from_str(&text).map_err(|e| Error::Internal(e.to_string()))
}
