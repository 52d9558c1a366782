//! REST: the event stream of a study.
//!
//! Recorded events have an id and are replayed after `Last-Event-ID`. Iterations of running solves have none, and can be
//! missed. A stream starts with the state of the study, and stays open after the end of the study, because the study can be
//! extended.

use crate::AppState;
use crate::extractors::Params;
use crate::problem_details::Refusal;
use crate::resources;
use crate::study_listener::{ListenerGone, Sender, StudyListener};
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use axum::response::sse::Event;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::workers::SolveProgress;
use gaitwright_store::{StudyId, TrialId, events, studies};
use serde::Deserialize;
use serde_json::json;
use std::collections::HashMap;
use std::time::{Duration, Instant};
use tokio::sync::broadcast::error::RecvError;

/// Least time between two iterations of a solve in the stream.
const THROTTLE: Duration = Duration::from_millis(250);
/// Number of events read at a time.
const BATCH: u32 = 200;

/// Where to start.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct From {
    after: Option<u32>,
}

/// Follow the events of a study
///
/// Sends `study_state` with the current state first, then the recorded events, each with an id, and `progress` events
/// of running solves. A client that sends `Last-Event-ID` receives the recorded events that followed it. The stream
/// stays open after the end of the study, because the study can be extended.
#[utoipa::path(
    get,
    path = "/studies/{id}/events",
    operation_id = "follow_study_events",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study"), ("after" = Option<u32>, Query, description = "Start after this event"), ("Last-Event-ID" = Option<i64>, Header, description = "Last event that was received")),
    responses((status = 200, description = "Server-sent events", body = String, content_type = "text/event-stream"), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    listening: StudyListener<Read>,
    State(app): State<AppState>,
    Params(from): Params<From>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let id = listening.study();
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let last = events::last(&mut reader, id).await?;
    // After a restore, a client may have seen larger numbers than the record has.
    let after = last_seen(&headers)?.or(from.after.map(i64::from)).map_or(last, |seen| seen.min(last));
    drop(reader);
    let state = json!({ "state": study.state, "reason": study.state_reason });
    let state = Event::default().event("study_state").json_data(state).map_err(|e| Error::Internal(e.to_string()))?;
    Ok(listening.stream(move |mut sender| async move {
        sender.send(state).await?;
        follow(&app, id, after, &mut sender).await
    }))
}

fn last_seen(headers: &HeaderMap) -> Result<Option<i64>, Error> {
    let Some(value) = headers.get("last-event-id") else { return Ok(None) };
    let text = value.to_str().unwrap_or_default();
    let malformed = || Error::invalid("Last-Event-ID", text, "the id of an event of this stream");
    text.parse().map(Some).map_err(|_| malformed())
}

async fn follow(app: &AppState, study: StudyId, mut after: i64, sender: &mut Sender<Read>) -> Result<(), ListenerGone> {
    let mut pulse = app.scheduler.pulse();
    let mut progress = app.scheduler.running_solves().listen();
    let mut shown: HashMap<TrialId, Instant> = HashMap::new();
    loop {
        after = replay(app, study, after, sender).await?;
        loop {
            tokio::select! {
                () = sender.closed() => return Err(ListenerGone),
                changed = pulse.changed() => {
                    changed.map_err(|_| ListenerGone)?;
                    break;
                }
                iteration = progress.recv() => match iteration {
                    Ok(progress) if progress.study_id == study && is_due(&mut shown, &progress) => {
                        let event = Event::default().event("progress").json_data(progress).map_err(|_| ListenerGone)?;
                        sender.send(event).await?;
                    }
                    Ok(_) | Err(RecvError::Lagged(_)) => {}
                    Err(RecvError::Closed) => return Err(ListenerGone),
                },
            }
        }
    }
}

async fn replay(
    app: &AppState,
    study: StudyId,
    mut after: i64,
    sender: &mut Sender<Read>,
) -> Result<i64, ListenerGone> {
    loop {
        let mut reader = app.read().await.map_err(|_| ListenerGone)?;
        let batch = events::after(&mut reader, study, after, BATCH).await.map_err(|_| ListenerGone)?;
        drop(reader);
        let Some(last) = batch.last() else { return Ok(after) };
        after = last.seq;
        for event in batch {
            let sent = Event::default().event(&event.kind).id(event.seq.to_string());
            let sent = sent.json_data(resources::events::Event::from(event)).map_err(|_| ListenerGone)?;
            sender.send(sent).await?;
        }
    }
}

fn is_due(shown: &mut HashMap<TrialId, Instant>, progress: &SolveProgress) -> bool {
    let now = Instant::now();
    let due = shown.get(&progress.trial_id).is_none_or(|before| now.duration_since(*before) >= THROTTLE);
    if due {
        shown.insert(progress.trial_id, now);
    }
    due
}
