//! Recorded events of studies.

use gaitwright_store::{Instant, StudyId, events};
use serde::Serialize;

/// Event of a study.
#[derive(Debug, Serialize)]
pub(crate) struct Event {
    /// Sequence number over all studies.
    seq: i64,
    /// Identifier of the study.
    study_id: StudyId,
    /// Kind of the event: `study_changed`, `trial_queued`, `trial_started`, `trial_ended`, `feedback_given`,
    /// `feedback_retracted`, `lab_session_answered`, `reported_unsafe`, `safety_reviewed`, `gait_certified`, `trial_explained`,
    /// `trial_not_explained`, `execution_reported`.
    kind: String,
    /// Details.
    payload: serde_json::Value,
    /// Time of the event.
    created_at: Instant,
}

impl From<events::Event> for Event {
    fn from(row: events::Event) -> Self {
        let events::Event { seq, study_id, kind, payload, created_at } = row;
        Self { seq, study_id, kind, payload, created_at }
    }
}
