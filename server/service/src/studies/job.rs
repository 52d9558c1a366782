//! Identifiers, kinds and states of jobs.

use gaitwright_store::TrialId;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use utoipa::ToSchema;

/// Kind of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobKind {
    /// The certificate of a gait.
    Certificate,
    /// The explanation of a trial without a gait.
    Explanation,
    /// The solve of a trial.
    Solve,
}

impl JobKind {
    const ALL: [Self; 3] = [Self::Certificate, Self::Explanation, Self::Solve];

    /// Name in identifiers and addresses.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Certificate => "certificate",
            Self::Explanation => "explanation",
            Self::Solve => "solve",
        }
    }
}

/// Identifier of a job, such as `solve-` and the identifier of its trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct JobId {
    /// Kind of the job.
    pub kind: JobKind,
    /// Trial of the job.
    pub trial: TrialId,
}

impl fmt::Display for JobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}", self.kind.as_str(), self.trial)
    }
}

impl FromStr for JobId {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = || format!("{text} is not the identifier of a job");
        let (kind, trial) = text.split_once('-').ok_or_else(unknown)?;
        let kind = JobKind::ALL.into_iter().find(|known| known.as_str() == kind).ok_or_else(unknown)?;
        Ok(Self { kind, trial: trial.parse().map_err(|_| unknown())? })
    }
}

impl TryFrom<String> for JobId {
    type Error = String;
    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<JobId> for String {
    fn from(id: JobId) -> Self {
        id.to_string()
    }
}

/// State of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobState {
    /// Waits for other jobs.
    Queued,
    /// In progress.
    Running,
    /// Ended with a result.
    Done,
    /// Ended without a result.
    Failed,
    /// Cancelled by a user or a program.
    Cancelled,
}
