//! The outermost layer: gives each request an identifier, and turns every failure into a problem document or an error
//! page.

use super::error_page_reader::RespondedTo;
use super::page_error::{is_for_programs, shown};
use super::problem_details::Problem;
use super::problem_kinds::ProblemKind;
use axum::extract::{MatchedPath, Request};
use axum::http::uri::{Authority, PathAndQuery};
use axum::http::{HeaderName, HeaderValue, Method, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::any::Any;
use tracing::Instrument;
use uuid::Uuid;

static REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Gives a request its identifier, for log lines and the response, and answers every failure below, time-outs and
/// panics included, with a problem document.
pub(super) async fn complete(request: Request, next: Next) -> Response {
    let id = Uuid::now_v7().simple().to_string();
    let span = span_of(&request, &id);
    let for_programs = is_for_programs(request.uri().path());
    let back = form_page(&request);
    let mut response = with_problem(next.run(request).instrument(span).await, &id, for_programs, back);
    if let Ok(id) = HeaderValue::from_str(&id) {
        response.headers_mut().insert(REQUEST_ID.clone(), id);
    }
    response
}

/// The page of this service with the form that was sent, as the browser names it.
fn form_page(request: &Request) -> Option<String> {
    let header = |name| request.headers().get(name).and_then(|value| value.to_str().ok());
    let page: Uri = header(header::REFERER).filter(|_| request.method() == Method::POST)?.parse().ok()?;
    let is_own = page.authority().map(Authority::as_str) == header(header::HOST);
    let address = page.path_and_query().map(PathAndQuery::as_str)?;
    // Two slashes would begin the name of another host.
    (is_own && address.starts_with('/') && !address.starts_with("//")).then(|| address.to_owned())
}

/// The log span of a request. It has the route instead of the address, which may contain a sign-in secret or the token
/// of a blind pair.
fn span_of(request: &Request, id: &str) -> tracing::Span {
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str);
    // At error level, so that no filter removes the identifier from a log line.
    tracing::error_span!("request", id, method = %request.method(), route)
}

/// Adds a problem document with the request identifier to a failure.
fn with_problem(mut response: Response, id: &str, for_programs: bool, back: Option<String>) -> Response {
    let problem = match response.extensions_mut().remove::<Problem>() {
        Some(problem) => problem,
        None if speaks_for_itself(&response) => return response,
        None => {
            // Every other failure logs its reason.
            if response.status().is_server_error() {
                tracing::error!(request = id, status = response.status().as_u16(), "a request failed");
            }
            Problem::of_status(response.status())
        }
    };
    let problem = Problem { request_id: Some(id.to_owned()), ..problem };
    let to = response.extensions().get::<RespondedTo>().copied();
    let new = if for_programs { problem.into_response() } else { shown(problem, to, back) };
    let (parts, body) = new.into_parts();
    *response.body_mut() = body;
    response.headers_mut().remove(header::CONTENT_LENGTH);
    // Keep headers of the failure, such as Allow or Retry-After.
    response.headers_mut().extend(parts.headers);
    response
}

/// Whether the response is a success, or a page or document that already shows the failure.
fn speaks_for_itself(response: &Response) -> bool {
    let status = response.status();
    if !status.is_client_error() && !status.is_server_error() {
        return true;
    }
    let kind = response.headers().get(header::CONTENT_TYPE).map_or(&b""[..], HeaderValue::as_bytes);
    [&b"text/html"[..], b"application/json"].iter().any(|known| kind.starts_with(known))
}

/// The response after a handler panicked.
#[allow(clippy::needless_pass_by_value)] // as the layer calls it
pub(super) fn after_panic(panic: Box<dyn Any + Send>) -> Response {
    let reason = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("unknown");
    tracing::error!(reason, "a handler panicked");
    let detail = "The service failed and logged the error. Check the current state before you try again.";
    Problem::new(ProblemKind::Internal, detail.to_owned()).into_response()
}
