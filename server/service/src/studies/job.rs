//! What jobs are called and where they can stand.

use gaitwright_store::TrialId;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use utoipa::ToSchema;

/// What a job makes.
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

    /// As shown.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Certificate => "certificate",
            Self::Explanation => "explanation",
            Self::Solve => "solve",
        }
    }
}

/// The identifier of a job: what it makes, and of which trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct JobId {
    /// What it makes.
    pub kind: JobKind,
    /// Of which trial.
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
        let unknown = || format!("{text} names no job");
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

/// Where a job stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobState {
    /// Others come first.
    Queued,
    /// It is under way.
    Running,
    /// Its result is there.
    Done,
    /// It gives no result.
    Failed,
    /// Somebody cancelled it.
    Cancelled,
}
