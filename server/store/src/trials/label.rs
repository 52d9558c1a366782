//! Label of a trial: the result of its evaluation.

use super::TrialState;
use crate::{StoreError, StoreResult};
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use utoipa::ToSchema;

/// Label of a trial: `converged`, the evaluation found a gait; `not_converged`, it found none, which is a result, too;
/// `not_executable`, it found a gait whose simulated walks are too short for the study, which is a result like
/// `not_converged`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Label {
    /// The evaluation found a gait.
    Converged,
    /// The evaluation found no gait.
    NotConverged,
    /// The evaluation found a gait, but simulated walks with it are too short for the study.
    NotExecutable,
}

impl Label {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        TrialState::from(self).as_str()
    }
}

impl From<Label> for TrialState {
    fn from(label: Label) -> Self {
        match label {
            Label::Converged => Self::Converged,
            Label::NotConverged => Self::NotConverged,
            Label::NotExecutable => Self::NotExecutable,
        }
    }
}

impl TrialState {
    /// The label of a trial in this state, if the state is a result.
    pub fn label(self) -> Option<Label> {
        match self {
            Self::Converged => Some(Label::Converged),
            Self::NotConverged => Some(Label::NotConverged),
            Self::NotExecutable => Some(Label::NotExecutable),
            Self::Queued | Self::Running | Self::Failed | Self::Lost | Self::Cancelled => None,
        }
    }

    /// Whether it is a result for the learner: converged, not converged or not executable.
    pub fn is_result(self) -> bool {
        self.label().is_some()
    }
}

impl FromStr for Label {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::Converged, Self::NotConverged, Self::NotExecutable]
            .into_iter()
            .find(|label| label.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("label", text))
    }
}
