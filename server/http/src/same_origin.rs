//! Changes come from our own pages or from programs, never from another site in the same browser.
//!
//! Browsers say with every request where it comes from (`Sec-Fetch-Site`, `Origin`), and a page cannot make them lie;
//! that, and a session cookie with `SameSite`, is the protection against forged requests. It covers every form and
//! every REST call alike, so none can forget a hidden field.

use super::client_address::Secure;
use super::identify::session_of;
use crate::problem::Refusal;
use axum::extract::Request;
use axum::http::{HeaderMap, Method, header};
use axum::middleware::Next;
use axum::response::Response;
use gaitwright_service::error::Error;

/// Refuses a change that a page of another origin sends.
pub(super) async fn check(request: Request, next: Next) -> Result<Response, Refusal> {
    let reads = matches!(*request.method(), Method::GET | Method::HEAD | Method::OPTIONS);
    let secure = request.extensions().get::<Secure>().copied().unwrap_or_default();
    if !reads && !is_ours(request.headers(), secure) {
        return Err(Error::Forbidden("a page of another origin may not change anything here".to_owned()).into());
    }
    Ok(next.run(request).await)
}

/// Browsers say where a request comes from; programs do not, and need not.
fn is_ours(headers: &HeaderMap, secure: Secure) -> bool {
    let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
    match text(&header::HeaderName::from_static("sec-fetch-site")) {
        Some("same-origin" | "none") => true,
        Some(_) => false,
        None => match (text(&header::ORIGIN), text(&header::HOST)) {
            (Some(origin), Some(host)) => origin.split_once("://") == Some((secure.scheme(), host)),
            (Some(_), None) => false,
            // A browser that says nothing of the origin, but is signed in, cannot be told from a forged form.
            (None, _) => session_of(headers).is_none(),
        },
    }
}
