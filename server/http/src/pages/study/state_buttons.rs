//! The buttons that start, pause, resume, stop and extend a study.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::Form;
use crate::page_error::PageError;
use axum::extract::State;
use axum::response::Redirect;
use gaitwright_service::access::Run;
use gaitwright_service::error::Error;
use gaitwright_service::studies::command;
use gaitwright_service::studies::lifecycle::StudyTransition;
use gaitwright_service::studies::study_extension::{self, StudyExtension};
use gaitwright_store::{StudyId, commit};
use serde::Deserialize;

/// A button of the page.
pub(super) struct TransitionButton {
    pub(super) transition: &'static str,
    pub(super) label: &'static str,
}

/// The form of a button.
#[derive(Debug, Deserialize)]
pub(in crate::pages) struct TransitionForm {
    transition: String,
    /// The new number of trials, for an extension.
    #[serde(default)]
    number_of_trials: String,
}

/// `POST /studies/{id}/do`.
pub(in crate::pages) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    Form(form): Form<TransitionForm>,
) -> Result<Redirect, PageError> {
    let transition = StudyTransition::ALL
        .into_iter()
        .find(|transition| transition.as_str() == form.transition && is_offered_on_pages(*transition))
        .ok_or_else(|| Error::invalid("transition", form.transition, "start, pause, resume, stop or extend"))?;
    let mut writer = app.write().await?;
    let cancelled = if transition == StudyTransition::Extend {
        let refused = || Error::invalid("number_of_trials", form.number_of_trials.as_str(), "a whole number");
        let more = StudyExtension { number_of_trials: form.number_of_trials.trim().parse().map_err(|_| refused())? };
        study_extension::extend(&mut writer, &authorized.caller.actor, id, &more).await?;
        Vec::new()
    } else {
        command::transition(&mut writer, &authorized.caller.actor, id, transition, "").await?.cancelled
    };
    commit(writer).await?;
    for trial in cancelled {
        app.scheduler.cancel_solve(trial).await;
    }
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/studies/{id}")))
}

/// Whether the page has a button for it.
pub(super) fn is_offered_on_pages(transition: StudyTransition) -> bool {
    matches!(
        transition,
        StudyTransition::Start
            | StudyTransition::Pause
            | StudyTransition::Resume
            | StudyTransition::Stop
            | StudyTransition::Extend
    )
}

/// Acts that need no confirmation.
pub(super) fn button(transition: StudyTransition) -> Option<TransitionButton> {
    match transition {
        StudyTransition::Start => Some(TransitionButton { transition: "start", label: "Start" }),
        StudyTransition::Pause => Some(TransitionButton { transition: "pause", label: "Pause" }),
        StudyTransition::Resume => Some(TransitionButton { transition: "resume", label: "Resume" }),
        _ => None,
    }
}
