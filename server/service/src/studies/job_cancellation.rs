//! Cancels jobs: backups, and solves, certificates, execution reports and explanations of trials.

use super::cancelled_trial;
use super::job_status::{JobStatus, Runners, find};
use crate::access::{Caller, Right};
use crate::backups;
use crate::error::Error;
use crate::job::{JobId, JobState};
use gaitwright_store::{Writer, audit, cancelled_jobs};
use serde_json::json;

/// Cancels a job that has not ended. Its work stops once the change is durable and [`stop`] was called.
///
/// # Errors
/// [`Error::Forbidden`] for the backup of an administrator, [`Error::NotFound`], or [`Error::Conflict`] when it has
/// ended.
pub async fn cancel(writer: &mut Writer, caller: &Caller, runners: Runners<'_>, id: JobId) -> Result<JobStatus, Error> {
    let job = find(writer, runners, id).await?;
    if !matches!(job.state, JobState::Queued | JobState::Running) {
        return Err(Error::conflict(format!("Job {id} has ended, so it cannot be cancelled.")));
    }
    match id {
        JobId::Backup(_) if !caller.may(Right::Administer) => {
            return Err(Error::Forbidden("Only an administrator can cancel a backup.".to_owned()));
        }
        JobId::Backup(backup) => backups::cancel(writer, &caller.actor, backup).await?,
        JobId::Solve(trial) => {
            cancelled_trial::cancel(writer, &caller.actor, trial, "Cancelled on request.").await?;
        }
        JobId::Certificate(_) | JobId::ExecutionReport(_) | JobId::Explanation(_) => {
            audit::append(writer, &caller.actor, cancelled_jobs::CANCELLED, &format!("job {id}"), &json!({})).await?;
        }
    }
    Ok(JobStatus { state: JobState::Cancelled, progress: None, solve: None, ..job })
}

/// Stops the work of a job whose cancellation is durable.
pub async fn stop(runners: Runners<'_>, id: JobId) {
    match id {
        JobId::Backup(backup) => runners.backups.stop(backup),
        JobId::Certificate(_) | JobId::ExecutionReport(_) | JobId::Explanation(_) | JobId::Solve(_) => {
            runners.scheduler.cancel_job(id).await;
        }
    }
}
