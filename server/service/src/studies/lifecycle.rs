//! The life of a study, as a pure function: which change is allowed from where.
//!
//! ```text
//! draft -> running <-> waiting        running, waiting -> finished
//!          running, waiting -> paused -> running
//!          draft, running, waiting, paused -> stopped
//!          finished, stopped -> running     (with a larger budget: `extend`)
//! ```

use gaitwright_store::studies::StudyState;
use thiserror::Error;

/// Something that is done to a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// A person starts it.
    Start,
    /// It needs a person's answer before it can go on.
    Ask,
    /// The answer is there.
    Answered,
    /// A person holds it; solves that run are finished, nothing new starts.
    Pause,
    /// A person lets it go on.
    Resume,
    /// Its budget is used or its stopping rule holds.
    Finish,
    /// A person ends it.
    Stop,
    /// A person gives an ended study more trials.
    Extend,
}

impl Act {
    /// Every act.
    pub const ALL: [Self; 8] =
        [Self::Start, Self::Ask, Self::Answered, Self::Pause, Self::Resume, Self::Finish, Self::Stop, Self::Extend];

    /// In words, for messages.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Ask => "wait for an answer in",
            Self::Answered => "go on with",
            Self::Pause => "pause",
            Self::Resume => "resume",
            Self::Finish => "finish",
            Self::Stop => "stop",
            Self::Extend => "extend",
        }
    }
}

/// The act is not possible in this state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("cannot {} a study that is {}; possible from here: {}", act.as_str(), state.as_str(), possible(*state))]
pub struct NotPossible {
    /// Where the study stands.
    pub state: StudyState,
    /// What was asked.
    pub act: Act,
}

/// Where a study stands after an act.
///
/// # Errors
/// [`NotPossible`] when the act makes no sense there.
pub fn after(state: StudyState, act: Act) -> Result<StudyState, NotPossible> {
    use StudyState::{Draft, Finished, Paused, Running, Stopped, Waiting};
    match (state, act) {
        (Draft, Act::Start) | (Waiting, Act::Answered) | (Paused, Act::Resume) | (Finished | Stopped, Act::Extend) => {
            Ok(Running)
        }
        (Running, Act::Ask) => Ok(Waiting),
        (Running | Waiting, Act::Pause) => Ok(Paused),
        (Running | Waiting, Act::Finish) => Ok(Finished),
        (Draft | Running | Waiting | Paused, Act::Stop) => Ok(Stopped),
        _ => Err(NotPossible { state, act }),
    }
}

/// The acts a person may do in this state.
pub fn acts_of_people(state: StudyState) -> Vec<Act> {
    [Act::Start, Act::Pause, Act::Resume, Act::Stop, Act::Extend]
        .into_iter()
        .filter(|act| after(state, *act).is_ok())
        .collect()
}

fn possible(state: StudyState) -> String {
    acts_of_people(state).into_iter().map(Act::as_str).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_act() -> impl Strategy<Value = Act> {
        (0..Act::ALL.len()).prop_map(|i| Act::ALL[i])
    }

    proptest! {
        #[test]
        fn a_study_that_ended_only_goes_on_when_it_is_extended(acts in proptest::collection::vec(any_act(), 0..40)) {
            let mut state = StudyState::Draft;
            for act in acts {
                let before = state;
                match after(state, act) {
                    Ok(next) => {
                        prop_assert_ne!(next, before);
                        prop_assert_ne!(next, StudyState::Draft);
                        if matches!(before, StudyState::Finished | StudyState::Stopped) {
                            prop_assert_eq!(act, Act::Extend);
                        }
                        state = next;
                    }
                    Err(refused) => prop_assert_eq!(refused, NotPossible { state: before, act }),
                }
            }
        }
    }

    #[test]
    fn every_state_is_reached_and_has_a_way_on() {
        for state in [
            StudyState::Draft,
            StudyState::Running,
            StudyState::Waiting,
            StudyState::Paused,
            StudyState::Finished,
            StudyState::Stopped,
        ] {
            assert!(!acts_of_people(state).is_empty(), "{state:?}");
        }
    }
}
