//! The explanation of a trial without a gait, on its page, and the button that requests it.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::format;
use crate::page_error::PageError;
use axum::extract::State;
use axum::response::Redirect;
use gait_optimizer::Violation;
use gait_optimizer::explanation::status_in_words;
use gaitwright_service::access::Run;
use gaitwright_service::studies::explanation::{self, ExplanationState};
use gaitwright_store::trials::Trial;
use gaitwright_store::{TrialId, commit};

/// Why a trial has no gait.
pub(super) struct NoGait {
    /// What the end of the solve means.
    pub(super) outcome: &'static str,
    /// The explanation, or its progress.
    pub(super) state: ExplanationState,
    /// The last event of the study so far; the page loads the explanation when a later one announces it.
    pub(super) last_event: i64,
}

impl NoGait {
    /// `None` if the trial has a gait or was not solved by the service.
    pub(super) fn new(trial: &Trial, state: ExplanationState, last_event: i64) -> Option<Self> {
        Some(Self { outcome: trial.status.and_then(status_in_words)?, state, last_event })
    }

    pub(super) fn is_coming(&self) -> bool {
        matches!(self.state, ExplanationState::BeingMade | ExplanationState::Waiting)
    }

    pub(super) fn may_be_asked(&self) -> bool {
        matches!(self.state, ExplanationState::Waiting | ExplanationState::NotAsked)
    }

    pub(super) fn amount(violation: &Violation) -> String {
        format::number(violation.amount)
    }
}

/// `POST /trials/{id}/explain`.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    explanation::ask(&mut writer, &authorized.caller.actor, id, app.scheduler.explaining(id)).await?;
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/trials/{id}#explanation")))
}
