//! Identifiers of objects that may be shown: their subject has not withdrawn consent.

use super::AppState;
use super::accessible::{Located, visible};
use super::authorization::RefusedRequest;
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use gaitwright_service::access::RequiredRight;
use std::marker::PhantomData;

/// An [`Id`](super::accessible::Id) of an object whose subject has not withdrawn consent. Handlers that show data take
/// this instead.
#[derive(Debug)]
pub(crate) struct Visible<T, P>(pub(crate) T, pub(crate) PhantomData<P>);

impl<T: Located, P: RequiredRight> FromRequestParts<AppState> for Visible<T, P> {
    type Rejection = RefusedRequest;

    async fn from_request_parts(parts: &mut Parts, app: &AppState) -> Result<Self, RefusedRequest> {
        let found = visible::<T, P>(parts, app).await;
        found.map(|id| Self(id, PhantomData)).map_err(|error| RefusedRequest::of(parts, error))
    }
}
