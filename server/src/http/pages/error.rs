//! Errors as pages.

use crate::error::Error;
use crate::http::problem::Problem;
use askama::Template;
use axum::http::StatusCode;
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
}

impl IntoResponse for PageError {
    fn into_response(self) -> Response {
        if !self.0.is_input() {
            tracing::error!(error = %self.0, "a page failed");
        }
        if matches!(self.0, Error::NotSignedIn(_)) {
            return Redirect::to("/sign-in").into_response();
        }
        let problem = Problem::from(&self.0);
        let status = StatusCode::from_u16(problem.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        match (ErrorPage { problem }).render() {
            Ok(text) => (status, Html(text)).into_response(),
            Err(_) => status.into_response(),
        }
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
pub async fn no_such_page(uri: axum::http::Uri) -> Response {
    let error = Error::NotFound { what: "the address".to_owned(), id: uri.path().to_owned() };
    if uri.path().starts_with("/api/") { error.into_response() } else { PageError(error).into_response() }
}
