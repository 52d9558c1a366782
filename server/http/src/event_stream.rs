//! Event streams: the one way to answer with what goes on after the request was answered.
//!
//! Whoever listens is asked for again while the stream runs: before an event is sent, and every second when none is. A
//! stream ends when its session or token has ended, when its user was disabled, lost the right or reaches the study no
//! more, and when the subject of the study withdrew consent.

use super::AppState;
use super::identify::Credential;
use super::may::Refused;
use super::shown::Shown;
use crate::problem::Refusal;
use axum::extract::{FromRequestParts, State};
use axum::http::request::Parts;
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use gaitwright_service::access::Permission;
use gaitwright_store::{StudyId, consents, members};
use std::convert::Infallible;
use std::marker::PhantomData;
use std::time::{Duration, Instant};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

/// How often a silent stream asks whether its listener still may listen.
const ASKS_EVERY: Duration = Duration::from_secs(1);
/// Events that follow each other within this time are sent after one question.
const HOLDS_FOR: Duration = Duration::from_millis(100);
/// Events that wait for a slow listener.
const AHEAD: usize = 16;
/// A proxy closes what is silent for long.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// Whoever listens to a study, with the right `P`: in place of [`Shown`] in a handler that streams.
pub(crate) struct Listening<P> {
    app: AppState,
    credential: Credential,
    study: StudyId,
    right: PhantomData<P>,
}

impl<P: Permission> FromRequestParts<AppState> for Listening<P> {
    type Rejection = Response;

    async fn from_request_parts(parts: &mut Parts, app: &AppState) -> Result<Self, Response> {
        let Shown(study, _) =
            Shown::<StudyId, P>::from_request_parts(parts, app).await.map_err(Refused::into_response)?;
        let credential = Credential::of(&parts.headers).map_err(|error| Refusal(error).into_response())?;
        let State(app) = State::<AppState>::from_request_parts(parts, app).await.map_err(|never| match never {})?;
        Ok(Self { app, credential, study, right: PhantomData })
    }
}

impl<P: Permission> Listening<P> {
    /// The study.
    pub(crate) fn study(&self) -> StudyId {
        self.study
    }

    /// Answers with the events that `produce` sends, as long as the listener may listen.
    pub(crate) fn stream<F>(self, produce: impl FnOnce(Sender<P>) -> F) -> Response
    where
        F: Future<Output = Result<(), Gone>> + Send + 'static,
    {
        let (events, receiver) = mpsc::channel(AHEAD);
        let sender = Sender { listening: self.copy(), events, asked: None };
        let produced = produce(sender);
        let stopping = self.app.scheduler.stopping();
        tokio::spawn(async move {
            tokio::select! {
                () = stopping.cancelled() => {}
                () = self.until_gone() => {}
                // Ends when the listener goes away, which is the normal end.
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
            // Either there was a change of the record, or a session may have ended by itself.
            let _ = tokio::time::timeout(ASKS_EVERY, pulse.changed()).await;
            if !self.may_listen().await {
                return;
            }
        }
    }

    /// Whether the listener still has the right and the study may still be shown. When that cannot be found out, not.
    async fn may_listen(&self) -> bool {
        let Ok(Some(caller)) = self.credential.caller(&self.app).await else { return false };
        let Ok(mut reader) = self.app.read().await else { return false };
        caller.may(P::NEEDED)
            && members::reaches(&mut reader, caller.reach(), self.study).await.is_ok_and(|reaches| reaches)
            && consents::may_be_shown(&mut reader, self.study).await.is_ok()
    }
}

/// The listener went away, or may not listen any more.
pub(crate) struct Gone;

/// Sends events to a listener.
pub(crate) struct Sender<P> {
    listening: Listening<P>,
    events: mpsc::Sender<Event>,
    /// When the listener was last found to be allowed to listen.
    asked: Option<Instant>,
}

impl<P: Permission> Sender<P> {
    /// Sends an event.
    pub(crate) async fn send(&mut self, event: Event) -> Result<(), Gone> {
        if self.asked.is_none_or(|asked| asked.elapsed() > HOLDS_FOR) {
            if !self.listening.may_listen().await {
                return Err(Gone);
            }
            self.asked = Some(Instant::now());
        }
        self.events.send(event).await.map_err(|_| Gone)
    }

    /// Waits until the listener goes away.
    pub(crate) async fn closed(&self) {
        self.events.closed().await;
    }
}
