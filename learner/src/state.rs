//! Everything a study's learner is, in one document.

use serde::{Deserialize, Serialize};

use crate::error::{LearnerError, Result};
use crate::feedback::FeedbackLog;
use crate::posterior::{Learner, Posterior};
use crate::propose::Proposal;
use crate::settings::LearnerSettings;
use crate::space::{ActionIndex, SearchSpace};

/// Version of the document written by this crate.
const VERSION: u32 = 1;

/// Space, settings, seed and log of a study, with the cache that speeds up the next question.
///
/// The document holds what results depend on and nothing else: a state that was written and read again answers bit
/// for bit as the one that was not.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Document", into = "Document")]
pub struct LearnerState {
    space: SearchSpace,
    settings: LearnerSettings,
    seed: u64,
    log: FeedbackLog,
    cache: Learner,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    version: u32,
    space: SearchSpace,
    settings: LearnerSettings,
    seed: u64,
    log: FeedbackLog,
}

impl TryFrom<Document> for LearnerState {
    type Error = LearnerError;

    fn try_from(document: Document) -> Result<Self> {
        if document.version != VERSION {
            return Err(LearnerError::UnknownVersion { version: document.version, newest: VERSION });
        }
        Self::new(document.space, document.settings, document.seed, document.log)
    }
}

impl From<LearnerState> for Document {
    fn from(state: LearnerState) -> Self {
        Self { version: VERSION, space: state.space, settings: state.settings, seed: state.seed, log: state.log }
    }
}

impl LearnerState {
    /// A state from its parts.
    ///
    /// # Errors
    /// When a setting is out of range or the log does not fit the space.
    pub fn new(space: SearchSpace, settings: LearnerSettings, seed: u64, log: FeedbackLog) -> Result<Self> {
        settings.validate()?;
        log.validate(&space, settings.categories())?;
        Ok(Self { space, settings, seed, log, cache: Learner::default() })
    }

    /// The space.
    pub fn space(&self) -> &SearchSpace {
        &self.space
    }

    /// The settings.
    pub fn settings(&self) -> &LearnerSettings {
        &self.settings
    }

    /// The log.
    pub fn log(&self) -> &FeedbackLog {
        &self.log
    }

    /// Replaces the log: usually the same with more at its end, but anything goes.
    ///
    /// # Errors
    /// When the log does not fit the space; the old log is kept.
    pub fn set_log(&mut self, log: FeedbackLog) -> Result<()> {
        log.validate(&self.space, self.settings.categories())?;
        self.log = log;
        Ok(())
    }

    /// The belief after the log.
    ///
    /// # Errors
    /// As [`crate::posterior`].
    pub fn posterior(&mut self) -> Result<Posterior> {
        self.cache.posterior(&self.space, &self.log, &self.settings)
    }

    /// The next action.
    ///
    /// # Errors
    /// As [`crate::propose`].
    pub fn propose(&mut self, pending: &[ActionIndex]) -> Result<Proposal> {
        self.cache.propose(&self.space, &self.log, pending, &self.settings, self.seed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feedback::Feedback;
    use crate::settings::Method;
    use crate::space::Dimension;

    #[test]
    fn a_document_gives_back_its_state_and_refuses_what_it_does_not_know() {
        let dimension = |name: &str| Dimension { name: name.into(), values: vec![0.0, 0.5, 1.0], lengthscale: 0.5 };
        let space = SearchSpace::new(vec![dimension("a"), dimension("b")]).unwrap();
        let log = FeedbackLog {
            visited: vec![ActionIndex(3), ActionIndex(1)],
            feedback: vec![Feedback::Preference { winner: ActionIndex(1), loser: ActionIndex(3) }],
        };
        let mut state = LearnerState::new(space, LearnerSettings::of(Method::Eubo), 9, log).unwrap();
        let text = serde_json::to_string(&state).unwrap();
        let mut read: LearnerState = serde_json::from_str(&text).unwrap();
        assert_eq!(state.propose(&[]).unwrap(), read.propose(&[]).unwrap());
        assert_eq!(serde_json::to_string(&read).unwrap(), text);
        for (from, to) in [
            ("\"version\":1", "\"version\":2"),
            ("\"visited\":[3", "\"visited\":[9"),
            ("\"preference_noise\":", "\"preference_noise\":-"),
            ("\"method\":\"eubo\"", "\"method\":\"guess\""),
            ("\"seed\":9", "\"seed\":9,\"more\":1"),
        ] {
            assert!(text.contains(from));
            assert!(serde_json::from_str::<LearnerState>(&text.replace(from, to)).is_err(), "{to}");
        }
    }
}
