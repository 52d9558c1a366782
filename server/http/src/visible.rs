//! Identifiers of objects that may be shown: their subject has not withdrawn consent.

use super::AppState;
use super::accessible::{Located, in_path};
use super::authorization::Refused;
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use gaitwright_service::access::Permission;
use gaitwright_service::error::Error;
use gaitwright_store::consents;
use std::marker::PhantomData;

/// An [`Id`](super::accessible::Id) of an object whose subject has not withdrawn consent. Handlers that show data take
/// this instead.
#[derive(Debug)]
pub(crate) struct Visible<T, P>(pub(crate) T, pub(crate) PhantomData<P>);

impl<T: Located, P: Permission> FromRequestParts<AppState> for Visible<T, P> {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, app: &AppState) -> Result<Self, Refused> {
        let found = visible::<T, P>(parts, app).await;
        found.map(|id| Self(id, PhantomData)).map_err(|error| Refused::of(parts, error))
    }
}

/// Reads the identifier in the path, and refuses it if the subject of its study withdrew consent.
pub(super) async fn visible<T: Located, P: Permission>(parts: &mut Parts, app: &AppState) -> Result<T, Error> {
    let (id, study) = in_path::<T, P>(parts, app).await?;
    if let Some(study) = study {
        consents::may_be_shown(&mut *app.read().await?, study).await?;
    }
    Ok(id)
}
