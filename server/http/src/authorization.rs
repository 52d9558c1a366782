//! Authorisation as a handler's argument: a handler gets its caller only together with a right.

use crate::page_error::{PageError, is_for_programs};
use crate::problem_details::Refusal;
use axum::extract::{FromRequestParts, OriginalUri};
use axum::http::Extensions;
use axum::http::request::Parts;
use axum::response::{IntoResponse, Response};
use gaitwright_service::access::{Caller, RequiredRight};
use gaitwright_service::error::Error;
use std::convert::Infallible;
use std::marker::PhantomData;

/// A caller with the right `P`.
#[derive(Debug)]
pub(crate) struct Authorized<P> {
    /// The caller.
    pub(crate) caller: Caller,
    right: PhantomData<P>,
}

/// A refusal: a problem document for programs, a page for people.
#[derive(Debug)]
pub(crate) struct RefusedRequest {
    error: Error,
    for_program: bool,
}

impl RefusedRequest {
    /// The refusal of this request.
    pub(crate) fn of(parts: &Parts, error: Error) -> Self {
        // Nested routers see only the rest of the path.
        let whole = parts.extensions.get::<OriginalUri>().map_or(&parts.uri, |original| &original.0);
        Self { error, for_program: is_for_programs(whole.path()) }
    }
}

impl IntoResponse for RefusedRequest {
    fn into_response(self) -> Response {
        if self.for_program { Refusal(self.error).into_response() } else { PageError::from(self.error).into_response() }
    }
}

/// The refusal of a request without a session or a token.
pub(crate) fn not_signed_in() -> Error {
    Error::NotSignedIn(
        "This request requires a session or a token. Sign in, or send `Authorization: Bearer TOKEN`.".to_owned(),
    )
}

/// The caller of a request, if it has the right.
pub(crate) fn permitted<P: RequiredRight>(extensions: &Extensions) -> Result<Caller, Error> {
    let caller = extensions.get::<Caller>().ok_or_else(not_signed_in)?;
    match P::NEEDED {
        Some(needed) if !caller.may(needed) => Err(Error::MissingRight(needed.as_str())),
        _ => Ok(caller.clone()),
    }
}

impl<P: RequiredRight, S: Send + Sync> FromRequestParts<S> for Authorized<P> {
    type Rejection = RefusedRequest;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, RefusedRequest> {
        let caller = permitted::<P>(&parts.extensions).map_err(|error| RefusedRequest::of(parts, error))?;
        Ok(Self { caller, right: PhantomData })
    }
}

/// The signed-in user; `None` if nobody is signed in.
#[derive(Debug)]
pub(crate) struct SignedIn(pub(crate) Option<Caller>);

impl<S: Send + Sync> FromRequestParts<S> for SignedIn {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(Self(parts.extensions.get::<Caller>().cloned()))
    }
}
