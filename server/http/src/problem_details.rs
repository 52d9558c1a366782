//! Problem documents (RFC 9457): maps each error to its HTTP response.

use super::problem_kinds::ProblemKind;
use axum::Json;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use gait_optimizer::ModelError;
use gaitwright_compute::ComputeError;
use gaitwright_service::dispatch_error::DispatchError;
use gaitwright_service::error::{Error, FieldError};
use gaitwright_service::studies::lifecycle::NotPossible;
use gaitwright_service::studies::walkable::NotWalkable;
use gaitwright_store::StoreError;
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

/// Media type of a problem document.
pub(super) const PROBLEM_JSON: &str = "application/problem+json";

/// An error response (problem details, RFC 9457).
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(super) struct Problem {
    /// URI of the kind of error, which is also the address of a page that explains it. It does not change between
    /// versions.
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    /// Name of this kind of problem.
    pub(super) title: &'static str,
    /// The HTTP status.
    pub(super) status: u16,
    /// Explanation of the problem in this request.
    pub(super) detail: String,
    /// Name of the field that was refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = String, required = false)]
    pub(super) field: Option<String>,
    /// Value that was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) value: Option<Value>,
    /// Values that are accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = String, required = false)]
    pub(super) allowed: Option<String>,
    /// Identifier of the request, as in the `X-Request-Id` header and the log.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = String, required = false)]
    pub(super) request_id: Option<String>,
}

impl Problem {
    /// A problem of a kind.
    pub(super) fn new(kind: ProblemKind, detail: String) -> Self {
        let entry = kind.entry();
        let (field, value, allowed, request_id) = (None, None, None, None);
        let (kind, title, status) = (entry.uri, entry.title, entry.status.as_u16());
        Self { kind, title, status, detail, field, value, allowed, request_id }
    }

    /// The default detail for a status.
    pub(super) fn of_status(status: StatusCode) -> Self {
        let kind = ProblemKind::of_status(status);
        Self { status: status.as_u16(), ..Self::new(kind, kind.entry().meaning.to_owned()) }
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
            Error::NotFound { .. } | Error::NoAddress(_) => Self::new(ProblemKind::NotFound, detail),
            Error::Malformed(_) => Self::new(ProblemKind::Malformed, detail),
            Error::Unreadable(field) => Self::new(ProblemKind::Malformed, detail).of(field),
            Error::UnsupportedMediaType(_) => Self::new(ProblemKind::UnsupportedMediaType, detail),
            Error::Invalid(field) => Self::new(ProblemKind::InvalidField, detail).of(field),
            Error::CursorOfAnotherList(cursor) => Self {
                field: Some("cursor".to_owned()),
                value: Some(cursor.as_str().into()),
                allowed: Some("the value of `next` from a page with the same path, filters and order".to_owned()),
                ..Self::new(ProblemKind::CursorOfAnotherList, detail)
            },
            Error::NotSignedIn(_) => Self::new(ProblemKind::NotSignedIn, detail),
            Error::TooManyAttempts(_) => Self::new(ProblemKind::TooManyAttempts, detail),
            Error::Changed(_) => Self::new(ProblemKind::Changed, detail),
            Error::TooLarge(_) => Self::new(ProblemKind::TooLarge, detail),
            Error::MethodNotAllowed { .. } => Self::new(ProblemKind::MethodNotAllowed, detail),
            Error::Forbidden(_) | Error::MissingRight(_) => Self::new(ProblemKind::Forbidden, detail),
            Error::Conflict(_) => Self::new(ProblemKind::Conflict, detail),
            Error::CannotBeUndone(_) => Self::new(ProblemKind::CannotBeUndone, detail),
            Error::Learner(_) => Self::new(ProblemKind::Learner, detail),
            Error::StorageFull(_) => Self::new(ProblemKind::StorageFull, detail),
            Error::NotReady(_) => Self::new(ProblemKind::NotReady, detail),
            Error::Store(StoreError::RecordVanished { .. }) => {
                Self::new(ProblemKind::RecordVanished, ProblemKind::RecordVanished.entry().meaning.to_owned())
            }
            Error::Store(_) | Error::Dispatch(_) | Error::Output(_) | Error::Internal(_) => Self::new(
                ProblemKind::Internal,
                "The service failed and logged the error. Nothing was changed.".to_owned(),
            ),
        }
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let mut response = (self.status(), [(header::CONTENT_TYPE, PROBLEM_JSON)], Json(&self)).into_response();
        // `responses::complete` adds the request id, and renders a page for browsers.
        response.extensions_mut().insert(self);
        response
    }
}

/// An error of the service as a response.
#[derive(Debug)]
pub(super) struct Refusal(pub(super) Error);

macro_rules! refused {
    ($($error:ty),*) => {$(
        impl From<$error> for Refusal {
            fn from(error: $error) -> Self {
                Self(error.into())
            }
        }
    )*};
}
refused!(Error, StoreError, ComputeError, ModelError, NotWalkable, DispatchError, NotPossible);

impl From<Refusal> for Error {
    fn from(Refusal(error): Refusal) -> Self {
        error
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let Self(error) = self;
        if matches!(error, Error::NotReady(_)) {
            tracing::warn!(%error, "a request was refused");
        } else if !error.is_input() {
            tracing::error!(%error, "a request failed");
        }
        let mut response = Problem::from(&error).into_response();
        let headers = response.headers_mut();
        match error {
            Error::NotSignedIn(_) => {
                headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer realm=\"gaitwright\""));
            }
            Error::TooManyAttempts(seconds) => {
                headers.insert(header::RETRY_AFTER, HeaderValue::from(seconds));
            }
            _ => {}
        }
        response
    }
}
