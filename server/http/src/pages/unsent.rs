//! What somebody sends after the session has ended: it is not stored, and not lost.
//!
//! The page that says so asks for name and password and carries the form along; after signing in it is sent with one
//! press, by whoever signed in.

use super::error::{PageError, is_for_programs, page};
use crate::AppState;
use crate::extract::unreadable;
use crate::may::SignedIn;
use askama::Template;
use axum::body::Bytes;
use axum::extract::{FromRequest, Request, State};
use axum::http::{Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;

/// A form that was sent and not taken.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Unsent {
    /// Where it was sent to; empty: there is none.
    #[serde(default)]
    pub(super) to: String,
    /// Its fields, as they were sent.
    #[serde(default)]
    pub(super) fields: String,
}

impl Unsent {
    /// Whether there is one, for a page of this service.
    pub(super) fn is_any(&self) -> bool {
        self.to.starts_with('/') && !self.to.starts_with("//") && !self.to.contains('\\')
    }

    /// Its fields by name.
    fn pairs(&self) -> Vec<(String, String)> {
        serde_urlencoded::from_str(&self.fields).unwrap_or_default()
    }
}

#[derive(Template)]
#[template(path = "sign_in.html")]
pub(super) struct SignInPage {
    pub(super) refused: Option<String>,
    pub(super) name: String,
    pub(super) unsent: Unsent,
}

/// After signing in: the form, to be sent.
#[derive(Template)]
#[template(path = "send_now.html")]
struct SendNowPage {
    to: String,
    fields: Vec<(String, String)>,
}

/// The page that sends a form whose sender has signed in meanwhile.
pub(super) fn send_now(unsent: &Unsent) -> super::error::Page {
    page(&SendNowPage { to: unsent.to.clone(), fields: unsent.pairs() })
}

/// Asks whoever sends a form and is not signed in to sign in, and keeps the form for them.
pub(super) async fn keep(
    State(app): State<AppState>,
    SignedIn(caller): SignedIn,
    request: Request,
    next: Next,
) -> Result<Response, PageError> {
    let to = request.uri().path().to_owned();
    let is_open = to.starts_with("/sign-") || is_for_programs(&to);
    if caller.is_some() || is_open || request.method() != Method::POST {
        return Ok(next.run(request).await);
    }
    let kind = request.headers().get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    let is_form = kind.starts_with("application/x-www-form-urlencoded");
    // A new password is typed once more; a file is chosen once more.
    let unsent = if is_form && to != "/account" {
        let body = Bytes::from_request(request, &app).await.map_err(|e| unreadable(e.status(), &e.body_text()))?;
        Unsent { to, fields: String::from_utf8_lossy(&body).into_owned() }
    } else {
        Unsent::default()
    };
    let refused = Some("you are not signed in any more: nothing of what you sent was stored".to_owned());
    let shown = page(&SignInPage { refused, name: String::new(), unsent })?;
    Ok((StatusCode::UNAUTHORIZED, shown).into_response())
}
