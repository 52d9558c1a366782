//! State of a study.

use crate::{StoreError, StoreResult};
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use utoipa::ToSchema;

/// State of a study: `not_started`, not started; `running`, proposing and evaluating trials; `waiting`, for an answer from a
/// person; `paused`, by a user or a program; `finished`, all trials are made or a stopping rule applied; `stopped`,
/// by a user or a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StudyState {
    /// Not started yet.
    NotStarted,
    /// Proposing and evaluating trials.
    Running,
    /// Waiting for a preference of a person.
    Waiting,
    /// Paused by a person.
    Paused,
    /// All trials are made, or a stopping rule applied.
    Finished,
    /// Stopped by a person.
    Stopped,
}

impl StudyState {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::NotStarted => "not_started",
            Self::Running => "running",
            Self::Waiting => "waiting",
            Self::Paused => "paused",
            Self::Finished => "finished",
            Self::Stopped => "stopped",
        }
    }

    /// Whether the study is finished or stopped.
    pub fn has_ended(self) -> bool {
        matches!(self, Self::Finished | Self::Stopped)
    }
}

impl FromStr for StudyState {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::NotStarted, Self::Running, Self::Waiting, Self::Paused, Self::Finished, Self::Stopped]
            .into_iter()
            .find(|state| state.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("study state", text))
    }
}
