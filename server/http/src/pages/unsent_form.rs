//! Forms that are sent after the session has ended: they are not stored, and not lost.
//!
//! The answer is a sign-in page that carries the form along. After signing in, the user sends the form with one button.

use crate::AppState;
use crate::authorization::SignedIn;
use crate::extractors::unreadable;
use crate::page_error::{PageError, is_for_programs, page};
use crate::refused_fields::RefusedFields;
use askama::Template;
use axum::body::Bytes;
use axum::extract::{FromRequest, Request, State};
use axum::http::{Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;

/// A form that was sent without a session.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Unsent {
    /// The address it was sent to; empty if there is no form.
    #[serde(default)]
    pub(super) to: String,
    /// Its fields, as sent.
    #[serde(default)]
    pub(super) fields: String,
}

impl Unsent {
    /// Whether there is a form, addressed to this service.
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
    pub(super) refused: RefusedFields,
    pub(super) name: String,
    pub(super) unsent: Unsent,
}

/// The page after signing in, which sends the form.
#[derive(Template)]
#[template(path = "unsent_form.html")]
struct SendNowPage {
    to: String,
    fields: Vec<(String, String)>,
}

/// Shows the form for sending after signing in.
pub(super) fn send_now(unsent: &Unsent) -> crate::page_error::PageResult {
    page(&SendNowPage { to: unsent.to.clone(), fields: unsent.pairs() })
}

/// Asks a caller without a session to sign in, and keeps the form.
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
    // Passwords and files have to be entered again.
    let unsent = if is_form && to != "/account" {
        let body = Bytes::from_request(request, &app).await.map_err(|e| unreadable(e.status(), &e.body_text()))?;
        Unsent { to, fields: String::from_utf8_lossy(&body).into_owned() }
    } else {
        Unsent::default()
    };
    let refused = RefusedFields::without_field("You are no longer signed in. Your entry was not saved.");
    let shown = page(&SignInPage { refused, name: String::new(), unsent })?;
    Ok((StatusCode::UNAUTHORIZED, shown).into_response())
}
