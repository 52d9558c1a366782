//! Protection against cross-site request forgery: refuses changes that pages of another origin send.
//!
//! Browsers state the origin of every request (`Sec-Fetch-Site`, `Origin`), and pages cannot forge it. Together with a
//! `SameSite` cookie this covers every form and REST call, so no form needs a hidden field.

use super::authentication::session_of;
use super::client_address::Secure;
use crate::problem_details::Refusal;
use axum::extract::Request;
use axum::http::{HeaderMap, Method, header};
use axum::middleware::Next;
use axum::response::Response;
use gaitwright_service::error::Error;

/// Refuses a change sent by a page of another origin.
pub(super) async fn check(request: Request, next: Next) -> Result<Response, Refusal> {
    let reads = matches!(*request.method(), Method::GET | Method::HEAD | Method::OPTIONS);
    let secure = request.extensions().get::<Secure>().copied().unwrap_or_default();
    if !reads && !is_ours(request.headers(), secure) {
        return Err(Error::Forbidden(
            "This request comes from another origin, so it was refused. Open the page on this service and try again."
                .to_owned(),
        )
        .into());
    }
    Ok(next.run(request).await)
}

/// Whether the request comes from our own page or from a program, which states no origin.
fn is_ours(headers: &HeaderMap, secure: Secure) -> bool {
    let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
    match text(&header::HeaderName::from_static("sec-fetch-site")) {
        Some("same-origin" | "none") => true,
        Some(_) => false,
        None => match (text(&header::ORIGIN), text(&header::HOST)) {
            (Some(origin), Some(host)) => origin.split_once("://") == Some((secure.scheme(), host)),
            (Some(_), None) => false,
            // Without an origin, a request of a signed-in browser could be forged.
            (None, _) => session_of(headers).is_none(),
        },
    }
}
