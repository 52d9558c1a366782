//! Idempotent requests: with an Idempotency-Key, a repeated request has one effect and the same response.

use super::AppState;
use super::accessible::StudyOfPath;
use super::authorization::permitted;
use super::body_limits::LONG_BODY_BYTES;
use super::extractors::{body, unreadable};
use crate::problem_details::Refusal;
use axum::body::Bytes;
use axum::extract::{FromRequest, Request};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::response::{IntoResponse, Response};
use gaitwright_service::access::{Caller, RequiredRight};
use gaitwright_service::error::Error;
use gaitwright_store::audit::Actor;
use gaitwright_store::idempotency::{self, KEY_UNIQUE, StoredResponse, fingerprint};
use gaitwright_store::{BorrowedWriter, OnConstraint, StudyId, commit, consents};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::marker::PhantomData;

static IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");
static REPLAYED: HeaderName = HeaderName::from_static("idempotency-replayed");

/// A changing request by a caller with the right `P`: caller, key and fingerprint.
#[derive(Debug)]
pub(crate) struct Idempotent<P> {
    /// The actor for the audit trail.
    pub(crate) actor: Actor,
    /// The caller.
    pub(crate) caller: Caller,
    key: Option<String>,
    request: String,
    study: Option<StudyId>,
    right: PhantomData<P>,
}

/// [`Idempotent`] with a JSON body.
#[derive(Debug)]
pub(crate) struct IdempotentWith<P, T>(pub(crate) Idempotent<P>, pub(crate) T);

/// The body of a stored response, an extension of the repeated one.
#[derive(Debug, Clone)]
pub(crate) struct StoredBody(pub(crate) String);

impl<P: RequiredRight> Idempotent<P> {
    /// Begins the transaction of the effect. The inner `Err` is the stored response of an earlier request with the key.
    pub(crate) async fn begin<'a>(&self, app: &'a AppState) -> Result<Result<BorrowedWriter<'a>, Response>, Error> {
        let mut writer = app.write().await?;
        let Some(key) = &self.key else { return Ok(Ok(writer)) };
        match idempotency::find(&mut writer, &self.actor, key).await? {
            None => Ok(Ok(writer)),
            Some(kept) if kept.request == self.request => {
                // A stored response can hold figures of a subject who has withdrawn consent since.
                if let Some(study) = self.study {
                    consents::may_be_shown(&mut writer, study).await?;
                }
                let mut repeated = response(&kept);
                repeated.headers_mut().insert(REPLAYED.clone(), HeaderValue::from_static("true"));
                repeated.extensions_mut().insert(StoredBody(kept.body));
                Ok(Err(repeated))
            }
            Some(_) => {
                Err(Error::conflict("This Idempotency-Key was already used for another request. Use a new key."))
            }
        }
    }

    /// The stored response of an earlier request with the key, if any.
    pub(crate) async fn earlier_response(&self, app: &AppState) -> Result<Option<Response>, Error> {
        if self.key.is_none() {
            return Ok(None);
        }
        Ok(self.begin(app).await?.err())
    }

    /// Begins the transaction of an effect whose response contains a secret, and therefore must not be stored.
    pub(crate) async fn begin_secret<'a>(&self, app: &'a AppState) -> Result<BorrowedWriter<'a>, Error> {
        if self.key.is_some() {
            let reason = "This request does not accept an Idempotency-Key, because its response contains a secret that is shown once.";
            return Err(Error::Malformed(reason.to_owned()));
        }
        Ok(app.write().await?)
    }

    /// Responds 201 with a new object and its address.
    pub(crate) async fn created<T: Serialize>(
        &self,
        app: &AppState,
        writer: BorrowedWriter<'_>,
        location: String,
        body: &T,
    ) -> Result<Response, Refusal> {
        self.finish(app, writer, StatusCode::CREATED, Some(location), body).await
    }

    /// Responds 200 with a changed object.
    pub(crate) async fn done<T: Serialize>(
        &self,
        app: &AppState,
        writer: BorrowedWriter<'_>,
        body: &T,
    ) -> Result<Response, Refusal> {
        self.finish(app, writer, StatusCode::OK, None, body).await
    }

    /// Responds 202 with a job and its address.
    pub(crate) async fn accepted<T: Serialize>(
        &self,
        app: &AppState,
        writer: BorrowedWriter<'_>,
        location: String,
        body: &T,
    ) -> Result<Response, Refusal> {
        self.finish(app, writer, StatusCode::ACCEPTED, Some(location), body).await
    }

    /// Stores the response, commits the change and notifies the scheduler.
    async fn finish<T: Serialize>(
        &self,
        app: &AppState,
        mut writer: BorrowedWriter<'_>,
        status: StatusCode,
        location: Option<String>,
        body: &T,
    ) -> Result<Response, Refusal> {
        let body = serde_json::to_string(body).map_err(|e| Error::Internal(e.to_string()))?;
        let kept = StoredResponse { request: self.request.clone(), status: status.as_u16(), location, body };
        if let Some(key) = &self.key {
            // Two concurrent requests with the same key can both have found no stored response.
            idempotency::insert(&mut writer, &self.actor, key, &kept).await.on_constraint(KEY_UNIQUE, || {
                Error::conflict(
                    "Another request with this Idempotency-Key was answered at the same time. Send the request again.",
                )
            })?;
        }
        commit(writer).await?;
        app.scheduler.changed();
        Ok(response(&kept))
    }
}

/// The one key in a request.
fn key_in(headers: &HeaderMap) -> Result<Option<String>, Error> {
    let malformed = |reason: &str| Error::Malformed(format!("The Idempotency-Key header {reason}."));
    let mut all = headers.get_all(&IDEMPOTENCY_KEY).iter();
    let Some(value) = all.next() else { return Ok(None) };
    if all.next().is_some() {
        return Err(malformed("occurs more than once"));
    }
    let printable = |key: &&str| (1..=200).contains(&key.len()) && !key.contains('\t');
    let key = value.to_str().ok().filter(printable);
    Ok(Some(key.ok_or_else(|| malformed("must have 1 to 200 printable ASCII characters"))?.to_owned()))
}

fn response(kept: &StoredResponse) -> Response {
    let status = StatusCode::from_u16(kept.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
    let mut response = (status, [(header::CONTENT_TYPE, "application/json")], kept.body.clone()).into_response();
    if let Some(location) = kept.location.as_ref().and_then(|l| HeaderValue::from_str(l).ok()) {
        response.headers_mut().insert(header::LOCATION, location);
    }
    response
}

async fn read<P: RequiredRight, S: Send + Sync>(
    request: Request,
    state: &S,
) -> Result<(Idempotent<P>, Method, HeaderMap, Bytes), Error> {
    let caller = permitted::<P>(request.extensions())?;
    let (method, path) = (request.method().clone(), request.uri().path().to_owned());
    let headers = request.headers().clone();
    let study = request.extensions().get::<StudyOfPath>().and_then(|of| of.0);
    let bytes = Bytes::from_request(request, state).await.map_err(|e| unreadable(e.status(), &e.body_text()))?;
    let idempotent = Idempotent {
        actor: caller.actor.clone(),
        caller,
        key: key_in(&headers)?,
        request: fingerprint(method.as_str(), &path, &bytes),
        study,
        right: PhantomData,
    };
    Ok((idempotent, method, headers, bytes))
}

impl<P: RequiredRight, S: Send + Sync> FromRequest<S> for Idempotent<P> {
    type Rejection = Refusal;

    async fn from_request(request: Request, state: &S) -> Result<Self, Refusal> {
        let (idempotent, _, _, bytes) = read(request, state).await?;
        // An unread field would be ignored silently.
        if !matches!(bytes.trim_ascii(), b"" | b"{}") {
            return Err(Error::Malformed("This operation takes no fields. Send no body, or {}.".to_owned()).into());
        }
        Ok(idempotent)
    }
}

impl<P: RequiredRight, T: DeserializeOwned + Send + 'static> FromRequest<AppState> for IdempotentWith<P, T> {
    type Rejection = Refusal;

    async fn from_request(request: Request, app: &AppState) -> Result<Self, Refusal> {
        let (idempotent, method, headers, bytes) = read(request, app).await?;
        if bytes.len() <= LONG_BODY_BYTES {
            return Ok(Self(idempotent, body(&method, &headers, &bytes)?));
        }
        let parsed = app.clone().compute(move |_| body(&method, &headers, &bytes)).await.map_err(Error::from)?;
        Ok(Self(idempotent, parsed?))
    }
}
