//! Extractors for JSON bodies, query strings and forms, whose errors are problem documents.

use crate::problem_details::Refusal;
use crate::query_string;
use axum::extract::{FromRequest, FromRequestParts, Request};
use axum::http::request::Parts;
use axum::http::{HeaderMap, Method, StatusCode, header};
use gaitwright_service::error::Error;
use gaitwright_service::json_document;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;

/// Reads a JSON body. Errors name the field.
pub(crate) fn body<T: DeserializeOwned>(method: &Method, headers: &HeaderMap, bytes: &[u8]) -> Result<T, Error> {
    // An absent body counts as an empty document, unless it would replace what is there.
    let absent = bytes.is_empty();
    if absent && method != Method::POST {
        return Err(Error::Malformed("The body is missing; it must be a JSON document.".to_owned()));
    }
    let bytes = if absent { b"{}" } else { bytes };
    let kind = headers.get(header::CONTENT_TYPE).and_then(|v| v.to_str().ok()).unwrap_or("");
    if !absent && !kind.split(';').next().is_some_and(|kind| kind.trim().eq_ignore_ascii_case("application/json")) {
        return Err(Error::UnsupportedMediaType(format!("The Content-Type is {kind:?}; it must be application/json.")));
    }
    json_document::read(bytes)
}

/// The error for a body that cannot be received.
pub(crate) fn unreadable(status: StatusCode, reason: &str) -> Error {
    if status == StatusCode::UNSUPPORTED_MEDIA_TYPE {
        Error::UnsupportedMediaType(reason.to_owned())
    } else {
        Error::Malformed(format!("The body cannot be read: {}.", reason.trim_end_matches('.')))
    }
}

/// The query string.
#[derive(Debug)]
pub(crate) struct Params<T>(pub(crate) T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequestParts<S> for Params<T> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Refusal> {
        Ok(Self(query_string::read(&query_string::pairs(parts.uri.query().unwrap_or_default())?)?))
    }
}

/// A submitted form.
#[derive(Debug)]
pub(crate) struct Form<T>(pub(crate) T);

/// The entries of a form whose fields depend on data, by field name.
pub(crate) type FormFields = BTreeMap<String, String>;

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for Form<T> {
    type Rejection = super::page_error::PageError;

    async fn from_request(request: Request, state: &S) -> Result<Self, Self::Rejection> {
        let axum::extract::RawForm(bytes) = axum::extract::RawForm::from_request(request, state)
            .await
            .map_err(|e| unreadable(e.status(), &e.body_text()))?;
        Ok(Self(query_string::read_form(&bytes)?))
    }
}
