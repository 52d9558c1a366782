//! Identifiers, kinds and states of jobs.

use gaitwright_store::{BackupId, TrialId};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use utoipa::ToSchema;

/// Kind of job: the `backup` of the record, the `solve` or `explanation` of a trial, or the `certificate` or
/// `execution_report` of a gait.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobKind {
    /// A backup of the record.
    Backup,
    /// The certificate of a gait.
    Certificate,
    /// The execution report of a gait.
    ExecutionReport,
    /// The explanation of a trial without a gait.
    Explanation,
    /// The solve of a trial.
    Solve,
}

/// Identifier of a job, such as `solve-` and the identifier of its trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum JobId {
    /// A backup.
    Backup(BackupId),
    /// The certificate of the gait of a trial.
    Certificate(TrialId),
    /// The execution report of the gait of a trial.
    ExecutionReport(TrialId),
    /// The explanation of a trial.
    Explanation(TrialId),
    /// The solve of a trial.
    Solve(TrialId),
}

impl JobId {
    /// Kind of the job.
    pub fn kind(self) -> JobKind {
        match self {
            Self::Backup(_) => JobKind::Backup,
            Self::Certificate(_) => JobKind::Certificate,
            Self::ExecutionReport(_) => JobKind::ExecutionReport,
            Self::Explanation(_) => JobKind::Explanation,
            Self::Solve(_) => JobKind::Solve,
        }
    }

    /// Trial of the job; `None` for a backup.
    pub fn trial(self) -> Option<TrialId> {
        match self {
            Self::Backup(_) => None,
            Self::Certificate(trial) | Self::ExecutionReport(trial) | Self::Explanation(trial) | Self::Solve(trial) => {
                Some(trial)
            }
        }
    }
}

impl fmt::Display for JobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Backup(id) => write!(f, "backup-{id}"),
            Self::Certificate(trial) => write!(f, "certificate-{trial}"),
            Self::ExecutionReport(trial) => write!(f, "execution_report-{trial}"),
            Self::Explanation(trial) => write!(f, "explanation-{trial}"),
            Self::Solve(trial) => write!(f, "solve-{trial}"),
        }
    }
}

impl FromStr for JobId {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = || format!("{text} is not the identifier of a job");
        let (kind, id) = text.split_once('-').ok_or_else(unknown)?;
        match kind {
            "backup" => id.parse().ok().map(Self::Backup),
            "certificate" => id.parse().ok().map(Self::Certificate),
            "execution_report" => id.parse().ok().map(Self::ExecutionReport),
            "explanation" => id.parse().ok().map(Self::Explanation),
            "solve" => id.parse().ok().map(Self::Solve),
            _ => None,
        }
        .ok_or_else(unknown)
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

/// State of a job: `queued` and `running`; `done`, it ended with a result; `failed`, it ended without one; `cancelled`,
/// by a user or a program.
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
