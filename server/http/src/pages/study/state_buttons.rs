//! The buttons that start, pause, resume, stop and extend a study.

use crate::refused_fields::{FieldLabels, TypedForm};
use gaitwright_service::access::Caller;
use gaitwright_service::error::Error;
use gaitwright_service::studies::command;
use gaitwright_service::studies::lifecycle::StudyTransition;
use gaitwright_service::studies::study_extension::{self, StudyExtension};
use gaitwright_store::{StudyId, TrialId, Writer};
use serde::Deserialize;

/// A button of the page.
pub(super) struct TransitionButton {
    pub(super) transition: &'static str,
    pub(super) label: &'static str,
}

/// The form of a button.
#[derive(Debug, Clone, Default, Deserialize)]
pub(in crate::pages) struct TransitionForm {
    transition: String,
    /// The new number of trials, for an extension.
    #[serde(default)]
    pub(super) number_of_trials: String,
}

impl TransitionForm {
    fn transition(&self) -> Result<StudyTransition, Error> {
        StudyTransition::ALL
            .into_iter()
            .find(|transition| transition.as_str() == self.transition && is_offered_on_pages(*transition))
            .ok_or_else(|| {
                Error::invalid("transition", self.transition.as_str(), "start, pause, resume, stop or extend")
            })
    }
}

impl TypedForm for TransitionForm {
    const LABELS: FieldLabels = &[("number_of_trials", "Number of trials")];

    /// Only one field can be refused.
    fn repair(&mut self, _: &str) -> bool {
        false
    }
}

/// Does what a button asks for. Returns the trials whose solves were cancelled.
pub(super) async fn press(
    writer: &mut Writer,
    caller: &Caller,
    id: StudyId,
    form: &TransitionForm,
) -> Result<Vec<TrialId>, Error> {
    let transition = form.transition()?;
    if transition != StudyTransition::Extend {
        return Ok(command::transition(writer, &caller.actor, id, transition, "").await?.cancelled);
    }
    let refused = || Error::invalid("number_of_trials", form.number_of_trials.as_str(), "a whole number");
    let more = StudyExtension { number_of_trials: form.number_of_trials.trim().parse().map_err(|_| refused())? };
    study_extension::extend(writer, &caller.actor, id, &more).await?;
    Ok(Vec::new())
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
