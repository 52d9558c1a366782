//! The listener of a stream of events, authorised again while the stream runs.
//!
//! Each stream checks its listener before every event, and every second without events. It ends when the session or
//! token expires, when the user is disabled or loses the right or the access to the study, and when the subject
//! withdraws consent.

use super::AppState;
use super::authentication::Credential;
use super::authorization::RefusedRequest;
use super::visible::Visible;
use crate::problem_details::Refusal;
use axum::extract::{FromRequestParts, State};
use axum::http::request::Parts;
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use gaitwright_service::access::RequiredRight;
use gaitwright_store::{StudyId, accessible_studies, consents};
use std::convert::Infallible;
use std::marker::PhantomData;
use std::time::{Duration, Instant};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

/// Interval of checks while there are no events.
const CHECK_INTERVAL: Duration = Duration::from_secs(1);
/// Time for which a check is valid.
const CHECK_VALIDITY: Duration = Duration::from_millis(100);
/// Length of the queue for a slow listener.
const QUEUE_LENGTH: usize = 16;
/// Interval of keep-alive comments, because proxies close silent connections.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// A listener to a study with the right `P`. Handlers of streams take it instead of [`Visible`].
pub(crate) struct StudyListener<P> {
    app: AppState,
    credential: Credential,
    study: StudyId,
    right: PhantomData<P>,
}

impl<P: RequiredRight> FromRequestParts<AppState> for StudyListener<P> {
    type Rejection = Response;

    async fn from_request_parts(parts: &mut Parts, app: &AppState) -> Result<Self, Response> {
        let Visible(study, _) =
            Visible::<StudyId, P>::from_request_parts(parts, app).await.map_err(RefusedRequest::into_response)?;
        let credential = Credential::of(&parts.headers).map_err(|error| Refusal(error).into_response())?;
        let State(app) = State::<AppState>::from_request_parts(parts, app).await.map_err(|never| match never {})?;
        Ok(Self { app, credential, study, right: PhantomData })
    }
}

impl<P: RequiredRight> StudyListener<P> {
    /// The study.
    pub(crate) fn study(&self) -> StudyId {
        self.study
    }

    /// Responds with the events that `produce` sends, as long as the listener is authorised.
    pub(crate) fn stream<F>(self, produce: impl FnOnce(Sender<P>) -> F) -> Response
    where
        F: Future<Output = Result<(), ListenerGone>> + Send + 'static,
    {
        let (events, receiver) = mpsc::channel(QUEUE_LENGTH);
        let sender = Sender { listening: self.copy(), events, asked: None };
        let produced = produce(sender);
        let stopping = self.app.scheduler.stopping();
        tokio::spawn(async move {
            tokio::select! {
                () = stopping.cancelled() => {}
                () = self.until_gone() => {}
                // The normal end: the listener went away.
                _ = produced => {}
            }
        });
        let stream = ReceiverStream::new(receiver).map(Ok::<Event, Infallible>);
        Sse::new(stream).keep_alive(KeepAlive::new().interval(KEEP_ALIVE)).into_response()
    }

    fn copy(&self) -> Self {
        Self { app: self.app.clone(), credential: self.credential.clone(), study: self.study, right: PhantomData }
    }

    async fn until_gone(&self) {
        let mut pulse = self.app.scheduler.pulse();
        loop {
            // Wakes on a change of the record, or after the interval, because sessions expire without a change.
            let _ = tokio::time::timeout(CHECK_INTERVAL, pulse.changed()).await;
            if !self.may_listen().await {
                return;
            }
        }
    }

    /// Whether the listener still has the right and the study may be shown. An error counts as no.
    async fn may_listen(&self) -> bool {
        let Ok(Some(caller)) = self.credential.caller(&self.app).await else { return false };
        let Ok(mut reader) = self.app.read().await else { return false };
        caller.may(P::NEEDED)
            && accessible_studies::reaches(&mut reader, caller.reach(), self.study).await.is_ok_and(|reaches| reaches)
            && consents::may_be_shown(&mut reader, self.study).await.is_ok()
    }
}

/// The listener went away, or lost its authorisation.
pub(crate) struct ListenerGone;

/// Sends events to a listener.
pub(crate) struct Sender<P> {
    listening: StudyListener<P>,
    events: mpsc::Sender<Event>,
    /// Time of the last successful check.
    asked: Option<Instant>,
}

impl<P: RequiredRight> Sender<P> {
    /// Sends an event.
    pub(crate) async fn send(&mut self, event: Event) -> Result<(), ListenerGone> {
        if self.asked.is_none_or(|asked| asked.elapsed() > CHECK_VALIDITY) {
            if !self.listening.may_listen().await {
                return Err(ListenerGone);
            }
            self.asked = Some(Instant::now());
        }
        self.events.send(event).await.map_err(|_| ListenerGone)
    }

    /// Waits until the listener disconnects.
    pub(crate) async fn closed(&self) {
        self.events.closed().await;
    }
}
