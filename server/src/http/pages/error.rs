//! Errors as pages.

use crate::access::Role;
use crate::error::Error;
use crate::http::identify::AnsweredTo;
use crate::http::problem::Problem;
use askama::Template;
use axum::extract::Request;
use axum::http::{Method, Uri, header};
use axum::middleware::Next;
use axum::response::{Html, IntoResponse, Redirect, Response};

/// An error that is shown as a page.
#[derive(Debug)]
pub struct PageError(Error);

impl<E: Into<Error>> From<E> for PageError {
    fn from(error: E) -> Self {
        Self(error.into())
    }
}

#[derive(Template)]
#[template(path = "error.html")]
struct ErrorPage {
    problem: Problem,
    /// Whom it is shown to: nobody has no navigation, a rater has one of its own.
    to: Option<AnsweredTo>,
}

impl IntoResponse for PageError {
    fn into_response(self) -> Response {
        if matches!(self.0, Error::NotSignedIn(_)) {
            return Redirect::to("/sign-in").into_response();
        }
        // `problems_as_pages` makes a page of it, with the navigation of whoever asked.
        self.0.into_response()
    }
}

fn shown(problem: Problem, to: Option<AnsweredTo>) -> Response {
    let status = problem.status();
    match (ErrorPage { problem, to }).render() {
        Ok(text) => (status, Html(text)).into_response(),
        Err(_) => status.into_response(),
    }
}

/// A page.
pub type Page = Result<Html<String>, PageError>;

/// Renders a template.
///
/// # Errors
/// When the template fails.
pub fn page(template: &impl Template) -> Page {
    Ok(Html(template.render().map_err(|e| Error::Internal(e.to_string()))?))
}

/// Any address that is no route.
pub async fn no_such_page(uri: Uri) -> Error {
    Error::NotFound { what: "the address".to_owned(), id: uri.path().to_owned() }
}

/// Any method that an address does not know.
pub async fn no_such_method(method: Method, uri: Uri) -> Error {
    Error::MethodNotAllowed { method: method.to_string(), path: uri.path().to_owned() }
}

/// Whether programs ask for what is there: they get problem documents, people get pages.
pub fn is_for_programs(path: &str) -> bool {
    ["/api/", "/static/"].iter().any(|start| path.starts_with(start))
        || ["/health", "/ready", "/metrics"].contains(&path)
}

/// Shows the problem documents of addresses for people as pages, wherever they come from.
pub async fn problems_as_pages(request: Request, next: Next) -> Response {
    let for_programs = is_for_programs(request.uri().path());
    let mut answer = next.run(request).await;
    if for_programs {
        return answer;
    }
    let Some(problem) = answer.extensions_mut().remove::<Problem>() else { return answer };
    let allow = answer.headers_mut().remove(header::ALLOW);
    let to = answer.extensions().get::<AnsweredTo>().copied();
    let mut shown = shown(problem, to);
    if let Some(allow) = allow {
        shown.headers_mut().insert(header::ALLOW, allow);
    }
    shown
}
