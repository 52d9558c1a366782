//! What may be shown of studies: nothing that was computed or said of a subject who withdrew.

use super::AppState;
use super::may::Refused;
use super::reached::{Located, in_path};
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use gaitwright_service::access::Permission;
use gaitwright_service::error::Error;
use gaitwright_store::consents;
use std::marker::PhantomData;

/// An [`Id`](super::reached::Id) of something whose subject did not withdraw. A handler that gives out figures asks for
/// this one in place of it.
#[derive(Debug)]
pub(crate) struct Shown<T, P>(pub(crate) T, pub(crate) PhantomData<P>);

impl<T: Located, P: Permission> FromRequestParts<AppState> for Shown<T, P> {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, app: &AppState) -> Result<Self, Refused> {
        let found = shown::<T, P>(parts, app).await;
        found.map(|id| Self(id, PhantomData)).map_err(|error| Refused::of(parts, error))
    }
}

async fn shown<T: Located, P: Permission>(parts: &mut Parts, app: &AppState) -> Result<T, Error> {
    let (id, study) = in_path::<T, P>(parts, app).await?;
    if let Some(study) = study {
        consents::may_be_shown(&mut *app.read().await?, study).await?;
    }
    Ok(id)
}
