//! A notice at the top of every page while the disk of the record is short of space.

use crate::AppState;
use crate::problem_details::Refusal;
use axum::body::{Body, to_bytes};
use axum::extract::{Request, State};
use axum::http::header;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use gaitwright_service::error::Error;

/// Where the content of a page begins, in `base.html`.
const CONTENT: &str = "<main id=\"content\">";

/// Adds the notice to pages; other answers pass unchanged.
pub(super) async fn show(State(app): State<AppState>, request: Request, next: Next) -> Response {
    let response = next.run(request).await;
    let kind = response.headers().get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok());
    let Err(shortage) = app.store().check_free_space() else { return response };
    if !kind.is_some_and(|kind| kind.starts_with("text/html")) {
        return response;
    }
    let (mut parts, body) = response.into_parts();
    let page = match to_bytes(body, usize::MAX).await {
        Ok(page) => String::from_utf8_lossy(&page).into_owned(),
        Err(error) => return Refusal(Error::Internal(error.to_string())).into_response(),
    };
    parts.headers.remove(header::CONTENT_LENGTH);
    let notice = format!("{CONTENT}\n    <p class=\"notice bad\" role=\"alert\">{shortage}</p>");
    Response::from_parts(parts, Body::from(page.replacen(CONTENT, &notice, 1)))
}
