//! Errors as pages.

use crate::error_page_reader::RespondedTo;
use crate::problem_details::{Problem, Refusal};
use askama::Template;
use axum::http::{Method, StatusCode, Uri};
use axum::response::{Html, IntoResponse, Redirect, Response};
use gaitwright_service::access::Role;
use gaitwright_service::error::Error;
use gaitwright_store::{StoreError, StudyId};

/// An error of a page handler.
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
    /// The reader's role decides the navigation; `None` shows none.
    to: Option<RespondedTo>,
    /// The address of the page with the refused form.
    back: Option<String>,
}

impl IntoResponse for PageError {
    fn into_response(self) -> Response {
        if matches!(self.0, Error::NotSignedIn(_)) {
            return Redirect::to("/sign-in").into_response();
        }
        let error = match self.0 {
            // The names of rights are for programs.
            Error::MissingRight(_) => {
                Error::Forbidden("Your account does not give access to this. Ask an administrator for it.".to_owned())
            }
            other => other,
        };
        // `responses::complete` renders it with the navigation of the caller.
        Refusal(error).into_response()
    }
}

/// A detail without the identifier of an object that does not exist, which means nothing to people.
fn without_identifier(detail: &str) -> Option<String> {
    let (start, id) = detail.strip_suffix('.')?.rsplit_once(' ')?;
    let what = start.strip_prefix("There is no ")?;
    // All identifiers are UUIDs.
    id.parse::<StudyId>().ok()?;
    if let Some((missing, owner)) = what.split_once(" for ") {
        return Some(format!("There is no {missing} for this {owner}."));
    }
    Some(format!("This {what} does not exist, or you do not have access to it."))
}

/// A plain heading for statuses whose problem title is HTTP jargon.
fn title(status: StatusCode, detail: &str) -> Option<&'static str> {
    match status {
        StatusCode::CONFLICT if detail == StoreError::Withdrawn.to_string() => Some("Consent withdrawn"),
        StatusCode::CONFLICT => Some("Not possible at present"),
        StatusCode::UNPROCESSABLE_ENTITY => Some("An entry was not accepted"),
        _ => None,
    }
}

/// Renders a problem as a page with the navigation of the caller.
pub(crate) fn shown(problem: Problem, to: Option<RespondedTo>, back: Option<String>) -> Response {
    let status = problem.status();
    let detail = match without_identifier(&problem.detail) {
        Some(detail) => detail,
        // A browser opens the address of a form only if somebody typed it.
        None if status == StatusCode::METHOD_NOT_ALLOWED => "There is no page at this address.".to_owned(),
        None => problem.detail.clone(),
    };
    let title = title(status, &detail).unwrap_or(problem.title);
    let problem = Problem { title, detail, ..problem };
    match (ErrorPage { problem, to, back }).render() {
        Ok(text) => (status, Html(text)).into_response(),
        Err(_) => status.into_response(),
    }
}

/// A rendered page, or the error to show.
pub type PageResult = Result<Html<String>, PageError>;

/// Renders a template.
///
/// # Errors
/// If the template fails.
pub fn page(template: &impl Template) -> PageResult {
    Ok(Html(template.render().map_err(|e| Error::Internal(e.to_string()))?))
}

/// Handles addresses without a route.
pub(crate) async fn no_such_page(uri: Uri) -> Refusal {
    Refusal(Error::NoAddress(uri.path().to_owned()))
}

/// Handles methods that a route does not have.
pub(crate) async fn no_such_method(method: Method, uri: Uri) -> Refusal {
    Refusal(Error::MethodNotAllowed { method: method.to_string(), path: uri.path().to_owned() })
}

/// Whether the address is for programs, which get problem documents instead of pages.
pub(crate) fn is_for_programs(path: &str) -> bool {
    ["/api/", "/static/"].iter().any(|start| path.starts_with(start))
        || ["/health", "/ready", "/metrics"].contains(&path)
}

#[cfg(test)]
mod tests {
    use super::without_identifier;

    #[test]
    fn page_names_no_identifier_of_a_missing_object() {
        let shown = without_identifier("There is no lab session 01890000-0000-7000-8000-000000000000.");
        assert_eq!(shown.as_deref(), Some("This lab session does not exist, or you do not have access to it."));
        let shown = without_identifier("There is no gait for trial 01890000-0000-7000-8000-000000000000.");
        assert_eq!(shown.as_deref(), Some("There is no gait for this trial."));
        assert_eq!(without_identifier("The address /nothing does not exist."), None);
    }
}
