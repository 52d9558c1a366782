//! Status and cancellation of jobs: solves, certificates and explanations of trials.
//!
//! A job has no row of its own. Its state follows from the record and the running process.

use super::command;
use super::explanation::{self, Effort, ExplanationState};
use super::job::{JobId, JobKind, JobState};
use super::scheduler::Scheduler;
use crate::access::Reach;
use crate::error::Error;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::jobs::{self, OpenSolve};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Connection, StudyId, TrialId, Writer, certificates, explanations, members, trials};
use serde_json::json;

/// Status of a job.
#[derive(Debug, Clone)]
pub struct JobStatus {
    /// Identifier.
    pub id: JobId,
    /// The study of its trial.
    pub study: StudyId,
    /// State.
    pub state: JobState,
    /// Reason if it failed.
    pub reason: Option<String>,
    /// Attempts and worker of a solve that has not ended.
    pub solve: Option<OpenSolve>,
}

/// The status of a job, which may have ended.
///
/// # Errors
/// [`Error::NotFound`] if it was never requested; errors of the database.
pub async fn find(db: &mut Connection, scheduler: &Scheduler, id: JobId) -> Result<JobStatus, Error> {
    let trial = trials::get(db, id.trial).await?;
    let found = match id.kind {
        JobKind::Solve => solve(&trial),
        JobKind::Certificate => certificate(db, scheduler, id.trial).await?,
        JobKind::Explanation => explanation(db, scheduler, &trial).await?,
    };
    let (state, reason) = found.ok_or_else(|| Error::NotFound { what: "job".to_owned(), id: id.to_string() })?;
    let solve = if id.kind == JobKind::Solve { jobs::open_of(db, id.trial).await? } else { None };
    Ok(JobStatus { id, study: trial.study_id, state, reason, solve })
}

/// State of a job, and the reason if it failed.
type Found = Option<(JobState, Option<String>)>;

fn solve(trial: &Trial) -> Found {
    if trial.asked_by.is_some() {
        // A script evaluates it.
        return None;
    }
    Some(match trial.state {
        TrialState::Queued => (JobState::Queued, None),
        TrialState::Running => (JobState::Running, None),
        TrialState::Converged | TrialState::NotConverged => (JobState::Done, None),
        TrialState::Cancelled => (JobState::Cancelled, None),
        TrialState::Failed | TrialState::Lost => (JobState::Failed, Some(trial.message.clone())),
    })
}

async fn certificate(db: &mut Connection, scheduler: &Scheduler, trial: TrialId) -> Result<Found, Error> {
    if certificates::find(db, trial).await?.is_some() {
        return Ok(Some((JobState::Done, None)));
    }
    let asked = scheduler.certifying().into_iter().find(|(asked, _)| *asked == trial);
    Ok(asked.map(|(_, state)| (state, None)))
}

async fn explanation(db: &mut Connection, scheduler: &Scheduler, trial: &Trial) -> Result<Found, Error> {
    let effort = scheduler.explaining(trial.id);
    let running = effort == Effort::Running;
    if effort == Effort::Cancelled {
        return Ok(Some((JobState::Cancelled, None)));
    }
    Ok(match explanation::state(db, trial, effort).await? {
        ExplanationState::Made(_) => Some((JobState::Done, None)),
        ExplanationState::BeingMade if running => Some((JobState::Running, None)),
        ExplanationState::BeingMade | ExplanationState::Waiting => Some((JobState::Queued, None)),
        ExplanationState::Refused(reason) => Some((JobState::Failed, Some(reason))),
        ExplanationState::NotAsked => None,
    })
}

/// The jobs that have not ended, of studies that a caller reaches, in the order of their identifiers.
///
/// # Errors
/// What the database reports.
pub async fn open(db: &mut Connection, scheduler: &Scheduler, reach: Reach) -> Result<Vec<JobStatus>, Error> {
    let mut all = Vec::new();
    for (trial, state) in scheduler.certifying() {
        let study = trials::get(db, trial).await?.study_id;
        if members::reaches(db, reach, study).await? {
            all.push(JobStatus {
                id: JobId { kind: JobKind::Certificate, trial },
                study,
                state,
                reason: None,
                solve: None,
            });
        }
    }
    for (trial, study) in explanations::requested(db, reach).await? {
        let state = match scheduler.explaining(trial) {
            Effort::Running => JobState::Running,
            Effort::Ready | Effort::None => JobState::Queued,
            Effort::Cancelled | Effort::Refused(_) => continue,
        };
        all.push(JobStatus {
            id: JobId { kind: JobKind::Explanation, trial },
            study,
            state,
            reason: None,
            solve: None,
        });
    }
    for solve in jobs::open(db, reach).await? {
        let state = if solve.worker.is_some() { JobState::Running } else { JobState::Queued };
        let (id, study) = (JobId { kind: JobKind::Solve, trial: solve.trial_id }, solve.study_id);
        all.push(JobStatus { id, study, state, reason: None, solve: Some(solve) });
    }
    all.sort_by_key(|job| job.id);
    Ok(all)
}

/// Cancels a job that has not ended. Its work stops once the change is durable and [`Scheduler::cancel_job`] was told.
///
/// # Errors
/// [`Error::NotFound`], or [`Error::Conflict`] when it has ended.
pub async fn cancel(writer: &mut Writer, actor: &Actor, scheduler: &Scheduler, id: JobId) -> Result<(), Error> {
    let job = find(writer, scheduler, id).await?;
    if !matches!(job.state, JobState::Queued | JobState::Running) {
        return Err(Error::conflict(format!("job {id} has ended")));
    }
    if id.kind == JobKind::Solve {
        command::cancel(writer, actor, id.trial, "Cancelled on request.").await?;
    } else {
        audit::append(writer, actor, "job.cancel", &format!("job {id}"), &json!({})).await?;
    }
    Ok(())
}
