//! The state machine of a study, as a pure function.
//!
//! ```text
//! not_started -> running <-> waiting        running, waiting -> finished
//!          running, waiting -> paused -> running
//!          not_started, running, waiting, paused -> stopped
//!          finished, stopped -> running     (with more trials: `extend`)
//! ```

use crate::error::Error;
use gaitwright_store::studies::StudyState;

/// A transition of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StudyTransition {
    /// A person starts the study.
    Start,
    /// The study needs a preference from a person before it can continue.
    Ask,
    /// A person gave the preference.
    Answered,
    /// A person pauses the study, or it is paused after failed trials. Running solves finish, and no new one starts.
    Pause,
    /// A person resumes the study.
    Resume,
    /// All trials are made, or a stopping rule applies.
    Finish,
    /// A person stops the study.
    Stop,
    /// A person raises the number of trials of an ended study.
    Extend,
}

impl StudyTransition {
    /// Every transition.
    pub const ALL: [Self; 8] =
        [Self::Start, Self::Ask, Self::Answered, Self::Pause, Self::Resume, Self::Finish, Self::Stop, Self::Extend];

    /// A verb for messages and the audit trail.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Ask => "ask for an answer in",
            Self::Answered => "continue",
            Self::Pause => "pause",
            Self::Resume => "resume",
            Self::Finish => "finish",
            Self::Stop => "stop",
            Self::Extend => "extend",
        }
    }
}

/// The transition is not possible in this state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("Cannot {} a study that is {}. Possible now: {}.", transition.as_str(), in_words(*state), possible(*state))]
pub struct NotPossible {
    /// The state of the study.
    pub state: StudyState,
    /// The requested transition.
    pub transition: StudyTransition,
}

impl From<NotPossible> for Error {
    fn from(error: NotPossible) -> Self {
        Self::Conflict(error.to_string())
    }
}

/// A state as the adjective of a sentence: `The study is not started`.
pub fn in_words(state: StudyState) -> &'static str {
    if state == StudyState::NotStarted { "not started" } else { state.as_str() }
}

/// The state of a study after a transition.
///
/// # Errors
/// [`NotPossible`] if the state does not allow the transition.
pub fn after(state: StudyState, transition: StudyTransition) -> Result<StudyState, NotPossible> {
    use StudyState::{Finished, NotStarted, Paused, Running, Stopped, Waiting};
    match (state, transition) {
        (NotStarted, StudyTransition::Start)
        | (Waiting, StudyTransition::Answered)
        | (Paused, StudyTransition::Resume)
        | (Finished | Stopped, StudyTransition::Extend) => Ok(Running),
        (Running, StudyTransition::Ask) => Ok(Waiting),
        (Running | Waiting, StudyTransition::Pause) => Ok(Paused),
        (Running | Waiting, StudyTransition::Finish) => Ok(Finished),
        (NotStarted | Running | Waiting | Paused, StudyTransition::Stop) => Ok(Stopped),
        _ => Err(NotPossible { state, transition }),
    }
}

/// The transitions that people can request in this state.
pub fn transitions_for_people(state: StudyState) -> Vec<StudyTransition> {
    [
        StudyTransition::Start,
        StudyTransition::Pause,
        StudyTransition::Resume,
        StudyTransition::Stop,
        StudyTransition::Extend,
    ]
    .into_iter()
    .filter(|transition| after(state, *transition).is_ok())
    .collect()
}

fn possible(state: StudyState) -> String {
    transitions_for_people(state).into_iter().map(StudyTransition::as_str).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_transition() -> impl Strategy<Value = StudyTransition> {
        (0..StudyTransition::ALL.len()).prop_map(|i| StudyTransition::ALL[i])
    }

    proptest! {
        #[test]
        fn ended_study_resumes_only_when_extended(transitions in proptest::collection::vec(any_transition(), 0..40)) {
            let mut state = StudyState::NotStarted;
            for transition in transitions {
                let before = state;
                match after(state, transition) {
                    Ok(next) => {
                        prop_assert_ne!(next, before);
                        prop_assert_ne!(next, StudyState::NotStarted);
                        if matches!(before, StudyState::Finished | StudyState::Stopped) {
                            prop_assert_eq!(transition, StudyTransition::Extend);
                        }
                        state = next;
                    }
                    Err(refused) => prop_assert_eq!(refused, NotPossible { state: before, transition }),
                }
            }
        }
    }

    #[test]
    fn every_state_is_reachable_and_can_be_left() {
        for state in [
            StudyState::NotStarted,
            StudyState::Running,
            StudyState::Waiting,
            StudyState::Paused,
            StudyState::Finished,
            StudyState::Stopped,
        ] {
            assert!(!transitions_for_people(state).is_empty(), "{state:?}");
        }
    }
}
