//! Live events of a study (Server-Sent Events).
//!
//! What is recorded has an id and is replayed after `Last-Event-ID`; iterations of running solves have none: who
//! misses one sees the next. A stream begins with where the study stands, so that who listens to one that has ended
//! knows; it stays open, because a study that has ended can be extended.

use crate::AppState;
use crate::event_stream::{Gone, Listening, Sender};
use crate::extract::Params;
use crate::problem::Refusal;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use axum::response::sse::Event;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::workers::Progress;
use gaitwright_store::{StudyId, TrialId, events, studies};
use serde::Deserialize;
use serde_json::json;
use std::collections::HashMap;
use std::time::{Duration, Instant};
use tokio::sync::broadcast::error::RecvError;

/// Shortest time between two iterations shown of one solve.
const THROTTLE: Duration = Duration::from_millis(250);
/// Events read at a time.
const BATCH: u32 = 200;

/// Where to begin.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct From {
    after: Option<i64>,
}

/// `GET /studies/{id}/events`.
#[utoipa::path(
    get,
    path = "/studies/{id}/events",
    operation_id = "follow_study_events",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study"), ("after" = Option<i64>, Query, description = "Begin after this event"), ("Last-Event-ID" = Option<i64>, Header, description = "The last event that was seen")),
    responses((status = 200, description = "Server-sent events. First `study_state`: where the study stands; then what is recorded, with an id, replayed after `Last-Event-ID`; and `progress` of running solves. The stream stays open when the study has ended: it can be extended", body = String, content_type = "text/event-stream"), (status = 409, description = "The subject withdrew consent"), (status = 422, description = "A parameter is not acceptable")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    listening: Listening<Read>,
    State(app): State<AppState>,
    Params(from): Params<From>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let id = listening.study();
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let last = events::last(&mut reader, id).await?;
    // What was seen may be of a record in whose place an older copy was put: its numbers come again.
    let after = last_seen(&headers)?.or(from.after).map_or(last, |seen| seen.min(last));
    drop(reader);
    let stands = json!({ "state": study.state, "reason": study.state_reason });
    let stands = Event::default().event("study_state").json_data(stands).map_err(|e| Error::Internal(e.to_string()))?;
    Ok(listening.stream(move |mut sender| async move {
        sender.send(stands).await?;
        follow(&app, id, after, &mut sender).await
    }))
}

fn last_seen(headers: &HeaderMap) -> Result<Option<i64>, Error> {
    let Some(value) = headers.get("last-event-id") else { return Ok(None) };
    let text = value.to_str().unwrap_or_default();
    let malformed = || Error::invalid("Last-Event-ID", text, "the id of an event of this stream");
    text.parse().map(Some).map_err(|_| malformed())
}

async fn follow(app: &AppState, study: StudyId, mut after: i64, sender: &mut Sender<Read>) -> Result<(), Gone> {
    let mut pulse = app.scheduler.pulse();
    let mut progress = app.scheduler.board().listen();
    let mut shown: HashMap<TrialId, Instant> = HashMap::new();
    loop {
        after = replay(app, study, after, sender).await?;
        loop {
            tokio::select! {
                () = sender.closed() => return Err(Gone),
                changed = pulse.changed() => {
                    changed.map_err(|_| Gone)?;
                    break;
                }
                iteration = progress.recv() => match iteration {
                    Ok(progress) if progress.study_id == study && is_due(&mut shown, &progress) => {
                        let event = Event::default().event("progress").json_data(progress).map_err(|_| Gone)?;
                        sender.send(event).await?;
                    }
                    Ok(_) | Err(RecvError::Lagged(_)) => {}
                    Err(RecvError::Closed) => return Err(Gone),
                },
            }
        }
    }
}

async fn replay(app: &AppState, study: StudyId, mut after: i64, sender: &mut Sender<Read>) -> Result<i64, Gone> {
    loop {
        let mut reader = app.read().await.map_err(|_| Gone)?;
        let batch = events::after(&mut reader, study, after, BATCH).await.map_err(|_| Gone)?;
        drop(reader);
        let Some(last) = batch.last() else { return Ok(after) };
        after = last.seq;
        for event in batch {
            let sent = Event::default().event(&event.kind).id(event.seq.to_string());
            let sent = sent.json_data(&event).map_err(|_| Gone)?;
            sender.send(sent).await?;
        }
    }
}

fn is_due(shown: &mut HashMap<TrialId, Instant>, progress: &Progress) -> bool {
    let now = Instant::now();
    let due = shown.get(&progress.trial_id).is_none_or(|before| now.duration_since(*before) >= THROTTLE);
    if due {
        shown.insert(progress.trial_id, now);
    }
    due
}
