//! Why there is no gait, on the page of a trial, and the button that asks for it.

use super::error::PageError;
use super::format;
use crate::AppState;
use crate::may::May;
use crate::reached::Id;
use axum::extract::State;
use axum::response::Redirect;
use gait_optimizer::Violation;
use gait_optimizer::explanation::verdict;
use gaitwright_service::access::Run;
use gaitwright_service::studies::explanation::{self, ExplanationState};
use gaitwright_store::trials::Trial;
use gaitwright_store::{TrialId, commit};

/// Why there is no gait.
pub(super) struct NoGait {
    /// What the end of the solve says.
    pub(super) verdict: &'static str,
    /// What was found out, or where that stands.
    pub(super) state: ExplanationState,
    /// The last event before that: what comes later brings the explanation.
    pub(super) last_event: i64,
}

impl NoGait {
    /// None where there is a gait, or no solve of the program.
    pub(super) fn new(trial: &Trial, state: ExplanationState, last_event: i64) -> Option<Self> {
        Some(Self { verdict: trial.status.and_then(verdict)?, state, last_event })
    }

    pub(super) fn is_coming(&self) -> bool {
        matches!(self.state, ExplanationState::BeingMade | ExplanationState::Waiting)
    }

    pub(super) fn may_be_asked(&self) -> bool {
        matches!(self.state, ExplanationState::Waiting | ExplanationState::NotAsked)
    }

    pub(super) fn missed_by(violation: &Violation) -> String {
        format::number(violation.amount)
    }
}

/// `POST /trials/{id}/explain`.
pub(super) async fn post(
    may: May<Run>,
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    explanation::ask(&mut writer, &may.caller.actor, id, app.scheduler.explaining(id)).await?;
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/trials/{id}#explanation")))
}
