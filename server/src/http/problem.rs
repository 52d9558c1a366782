//! Problem documents (RFC 9457): the one table from errors to answers.

use crate::error::{Error, FieldError};
use axum::Json;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

/// Media type of a problem document.
pub(super) const PROBLEM_JSON: &str = "application/problem+json";

/// A problem document.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(super) struct Problem {
    /// What kind of problem: stable, for programs.
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    /// The kind in words.
    pub(super) title: &'static str,
    /// The HTTP status.
    pub(super) status: u16,
    /// This occurrence in words.
    pub(super) detail: String,
    /// The field that was refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) field: Option<String>,
    /// The value that was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) value: Option<Value>,
    /// What would have been accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) allowed: Option<String>,
}

impl Problem {
    fn new(status: StatusCode, kind: &'static str, title: &'static str, detail: String) -> Self {
        Self { kind, title, status: status.as_u16(), detail, field: None, value: None, allowed: None }
    }

    fn of(self, field: &FieldError) -> Self {
        let FieldError { field, value, allowed, .. } = field.clone();
        Self { field: Some(field), value, allowed, ..self }
    }

    /// The HTTP status of this problem.
    pub(super) fn status(&self) -> StatusCode {
        StatusCode::from_u16(self.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR)
    }
}

impl From<&Error> for Problem {
    fn from(error: &Error) -> Self {
        let detail = error.to_string();
        match error {
            Error::NotFound { .. } => {
                Self::new(StatusCode::NOT_FOUND, "/problems/not-found", "There is no such thing", detail)
            }
            Error::Malformed(_) => {
                Self::new(StatusCode::BAD_REQUEST, "/problems/malformed", "The request cannot be read", detail)
            }
            Error::Unreadable(field) => {
                Self::new(StatusCode::BAD_REQUEST, "/problems/malformed", "The request cannot be read", detail)
                    .of(field)
            }
            Error::Invalid(field) => Self::new(
                StatusCode::UNPROCESSABLE_ENTITY,
                "/problems/invalid-field",
                "A field is not acceptable",
                detail,
            )
            .of(field),
            Error::NotSignedIn(_) => {
                Self::new(StatusCode::UNAUTHORIZED, "/problems/not-signed-in", "Sign in first", detail)
            }
            Error::TooManyAttempts(_) => {
                Self::new(StatusCode::TOO_MANY_REQUESTS, "/problems/too-many-attempts", "Too many attempts", detail)
            }
            Error::Changed(_) => Self::new(
                StatusCode::PRECONDITION_FAILED,
                "/problems/changed",
                "It was changed since it was read",
                detail,
            ),
            Error::TooLarge(_) => {
                Self::new(StatusCode::PAYLOAD_TOO_LARGE, "/problems/too-large", "The request is too large", detail)
            }
            Error::MethodNotAllowed { .. } => Self::new(
                StatusCode::METHOD_NOT_ALLOWED,
                "/problems/method-not-allowed",
                "Not possible with this method",
                detail,
            ),
            Error::Forbidden(_) => Self::new(StatusCode::FORBIDDEN, "/problems/forbidden", "Not allowed", detail),
            Error::Conflict(_) => {
                Self::new(StatusCode::CONFLICT, "/problems/conflict", "Not possible in the present state", detail)
            }
            Error::Learner(_) => Self::new(
                StatusCode::UNPROCESSABLE_ENTITY,
                "/problems/learner",
                "The learner cannot work with this",
                detail,
            ),
            Error::Store(_) | Error::Dispatch(_) | Error::Internal(_) => Self::new(
                StatusCode::INTERNAL_SERVER_ERROR,
                "/problems/internal",
                "The program failed",
                "the failure was logged; nothing was changed".to_owned(),
            ),
        }
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let mut answer = (self.status(), [(header::CONTENT_TYPE, PROBLEM_JSON)], Json(&self)).into_response();
        // For pages, which show the same problem in words.
        answer.extensions_mut().insert(self);
        answer
    }
}

impl IntoResponse for Error {
    fn into_response(self) -> Response {
        if !self.is_input() {
            tracing::error!(error = %self, "a request failed");
        }
        let mut answer = Problem::from(&self).into_response();
        let headers = answer.headers_mut();
        match self {
            Self::NotSignedIn(_) => {
                headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer realm=\"gaitwright\""));
            }
            Self::TooManyAttempts(seconds) => {
                headers.insert(header::RETRY_AFTER, HeaderValue::from(seconds));
            }
            _ => {}
        }
        answer
    }
}
