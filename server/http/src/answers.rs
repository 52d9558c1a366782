//! What holds for every answer: it names its request, and one that is no success is a problem document or its page.

use super::identify::AnsweredTo;
use super::pages::error::{is_for_programs, shown};
use super::problem::Problem;
use super::problem_kinds::Kind;
use axum::extract::{MatchedPath, Request};
use axum::http::{HeaderName, HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::any::Any;
use tracing::Instrument;
use uuid::Uuid;

static REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Gives a request its identifier, for its log lines and its answer, and sees to it that whatever refuses or fails below,
/// be it a time-out or a panic, is answered with a problem document.
pub(super) async fn complete(request: Request, next: Next) -> Response {
    let id = Uuid::now_v7().simple().to_string();
    let span = span_of(&request, &id);
    let for_programs = is_for_programs(request.uri().path());
    let mut answer = with_problem(next.run(request).instrument(span).await, &id, for_programs);
    if let Ok(id) = HeaderValue::from_str(&id) {
        answer.headers_mut().insert(REQUEST_ID.clone(), id);
    }
    answer
}

/// What log lines say of their request: its route and not its address, which holds the secret of a sign-in link or the
/// token of a blind pair.
fn span_of(request: &Request, id: &str) -> tracing::Span {
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str);
    // Of the level of errors, so that no filter takes the identifier away from a line that it lets through.
    tracing::error_span!("request", id, method = %request.method(), route)
}

/// The answer; where it is a refusal or failure, with a problem document that has the identifier of the request.
fn with_problem(mut answer: Response, id: &str, for_programs: bool) -> Response {
    let problem = match answer.extensions_mut().remove::<Problem>() {
        Some(problem) => problem,
        None if speaks_for_itself(&answer) => return answer,
        None => Problem::of_status(answer.status()),
    };
    let problem = Problem { request_id: Some(id.to_owned()), ..problem };
    let to = answer.extensions().get::<AnsweredTo>().copied();
    let new = if for_programs { problem.into_response() } else { shown(problem, to) };
    let (parts, body) = new.into_parts();
    *answer.body_mut() = body;
    answer.headers_mut().remove(header::CONTENT_LENGTH);
    // What the refusal said beside its body, such as Allow or Retry-After, stays.
    answer.headers_mut().extend(parts.headers);
    answer
}

/// A success, or a form or figure that shows by itself why it was refused.
fn speaks_for_itself(answer: &Response) -> bool {
    let status = answer.status();
    if !status.is_client_error() && !status.is_server_error() {
        return true;
    }
    let kind = answer.headers().get(header::CONTENT_TYPE).map_or(&b""[..], HeaderValue::as_bytes);
    [&b"text/html"[..], b"application/json"].iter().any(|known| kind.starts_with(known))
}

/// The answer to a request whose handler panicked.
#[allow(clippy::needless_pass_by_value)] // as the layer calls it
pub(super) fn after_panic(panic: Box<dyn Any + Send>) -> Response {
    let reason = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("unknown");
    tracing::error!(reason, "a handler panicked");
    let detail = "the failure was logged; look at the present state before you try again";
    Problem::new(Kind::Internal, detail.to_owned()).into_response()
}
