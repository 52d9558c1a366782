//! State of a trial.

use crate::{StoreError, StoreResult};
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use utoipa::ToSchema;

/// State of a trial. `queued` and `running` trials are open. `converged`, `not_converged` and
/// `not_executable` (a gait whose simulated walks are too short for the study) are results; `failed` (error, crash or time
/// limit), `lost` (the worker stopped responding) and `cancelled` are not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TrialState {
    /// Waiting for a worker.
    Queued,
    /// Being evaluated.
    Running,
    /// The solve found a gait. A result.
    Converged,
    /// The solve ended without a gait. Also a result.
    NotConverged,
    /// The solve found a gait, but simulated walks with it are too short for the study. Also a result.
    NotExecutable,
    /// The program failed by a panic, an error or the time limit. Not a result.
    Failed,
    /// The workers stopped responding. Not a result.
    Lost,
    /// Cancelled by a person.
    Cancelled,
}

impl TrialState {
    /// Every state.
    pub const ALL: [Self; 8] = [
        Self::Queued,
        Self::Running,
        Self::Converged,
        Self::NotConverged,
        Self::NotExecutable,
        Self::Failed,
        Self::Lost,
        Self::Cancelled,
    ];

    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Converged => "converged",
            Self::NotConverged => "not_converged",
            Self::NotExecutable => "not_executable",
            Self::Failed => "failed",
            Self::Lost => "lost",
            Self::Cancelled => "cancelled",
        }
    }

    /// Whether the solve found a gait. Only a converged gait may reach a person.
    pub fn has_gait(self) -> bool {
        matches!(self, Self::Converged | Self::NotExecutable)
    }

    /// Whether it is queued or running.
    pub fn is_open(self) -> bool {
        matches!(self, Self::Queued | Self::Running)
    }
}

impl FromStr for TrialState {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        Self::ALL
            .into_iter()
            .find(|state| state.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("trial state", text))
    }
}
