//! Status of jobs: backups, and solves, certificates, execution reports and explanations of trials.
//!
//! Solves have a queue in the record, and requests for explanations a table. The state of every job follows from the record
//! and the running process.

use super::execution::{self, Simulation};
use super::explanation::{self, ExplanationEffort, ExplanationState};
use super::scheduler::Scheduler;
use crate::access::Reach;
use crate::backups::Backups;
use crate::error::Error;
use crate::job::{JobId, JobState};
use gaitwright_store::solve_jobs::{self, OpenSolve};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Connection, StudyId, TrialId, accessible_studies, certificates, explanations, trials};

/// Status of a job.
#[derive(Debug, Clone)]
pub struct JobStatus {
    /// Identifier.
    pub id: JobId,
    /// The study of its trial; `None` for a backup.
    pub study: Option<StudyId>,
    /// State.
    pub state: JobState,
    /// Reason if it failed.
    pub reason: Option<String>,
    /// Share of the work that is done, 0 to 1, where it is known.
    pub progress: Option<f64>,
    /// Attempts and worker of a solve that has not ended.
    pub solve: Option<OpenSolve>,
}

/// The runners of jobs in this process.
#[derive(Debug, Clone, Copy)]
pub struct Runners<'a> {
    /// Runs the jobs of trials.
    pub scheduler: &'a Scheduler,
    /// Makes backups.
    pub backups: &'a Backups,
}

/// The status of a job, which may have ended.
///
/// # Errors
/// [`Error::NotFound`] if it was never requested; errors of the database.
pub async fn find(db: &mut Connection, runners: Runners<'_>, id: JobId) -> Result<JobStatus, Error> {
    let missing = || Error::NotFound { what: "job".to_owned(), id: id.to_string() };
    let trial = match id.trial() {
        Some(trial) => Some(trials::get(db, trial).await?),
        None => None,
    };
    let found = match (id, &trial) {
        (JobId::Backup(backup), _) => runners.backups.find(db, backup).await?,
        (JobId::Solve(_), Some(trial)) => solve(trial),
        (JobId::Certificate(id), _) => certificate(db, runners.scheduler, id).await?,
        (JobId::ExecutionReport(id), _) => execution_report(db, runners.scheduler, id).await?,
        (JobId::Explanation(_), Some(trial)) => explanation(db, runners.scheduler, trial).await?,
        (JobId::Solve(_) | JobId::Explanation(_), None) => None,
    };
    let (state, reason) = found.ok_or_else(missing)?;
    let solve = if let JobId::Solve(trial) = id { solve_jobs::open_of(db, trial).await? } else { None };
    let progress = progress(runners.scheduler, id);
    Ok(JobStatus { id, study: trial.map(|trial| trial.study_id), state, reason, progress, solve })
}

/// State of a job, and the reason if it failed.
type FoundState = Option<(JobState, Option<String>)>;

fn solve(trial: &Trial) -> FoundState {
    if trial.script.is_some() {
        // A script evaluates it.
        return None;
    }
    Some(match trial.state {
        TrialState::Queued => (JobState::Queued, None),
        TrialState::Running => (JobState::Running, None),
        TrialState::Converged | TrialState::NotConverged | TrialState::NotExecutable => (JobState::Done, None),
        TrialState::Cancelled => (JobState::Cancelled, None),
        TrialState::Failed | TrialState::Lost => (JobState::Failed, Some(trial.message.clone())),
    })
}

async fn certificate(db: &mut Connection, scheduler: &Scheduler, trial: TrialId) -> Result<FoundState, Error> {
    if certificates::find(db, trial).await?.is_some() {
        return Ok(Some((JobState::Done, None)));
    }
    Ok(scheduler.certifying(trial))
}

async fn execution_report(db: &mut Connection, scheduler: &Scheduler, trial: TrialId) -> Result<FoundState, Error> {
    Ok(match scheduler.simulating(trial) {
        Simulation::Queued(_) => Some((JobState::Queued, None)),
        Simulation::Running { .. } => Some((JobState::Running, None)),
        Simulation::Cancelled => Some((JobState::Cancelled, None)),
        Simulation::Failed(reason) => Some((JobState::Failed, Some(reason))),
        Simulation::None => execution::newest(db, trial).await?.map(|_| (JobState::Done, None)),
    })
}

fn progress(scheduler: &Scheduler, id: JobId) -> Option<f64> {
    let JobId::ExecutionReport(trial) = id else { return None };
    match scheduler.simulating(trial) {
        Simulation::Running { done, of, .. } => Some(f64::from(done) / f64::from(of.max(1))),
        _ => None,
    }
}

async fn explanation(db: &mut Connection, scheduler: &Scheduler, trial: &Trial) -> Result<FoundState, Error> {
    let effort = scheduler.explaining(trial.id);
    let running = matches!(effort, ExplanationEffort::Running(_));
    if effort == ExplanationEffort::Cancelled {
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

/// The jobs that have not ended, of studies that a caller can access, in the order of their identifiers.
///
/// # Errors
/// Errors of the database.
pub async fn open(db: &mut Connection, runners: Runners<'_>, reach: Reach) -> Result<Vec<JobStatus>, Error> {
    let status = |id, study, state, solve| {
        let progress = progress(runners.scheduler, id);
        JobStatus { id, study, state, reason: None, progress, solve }
    };
    let mut all: Vec<JobStatus> = runners
        .backups
        .running()
        .into_iter()
        .map(|id| status(JobId::Backup(id), None, JobState::Running, None))
        .collect();
    for (id, trial, state) in runners.scheduler.jobs_after_solves() {
        let study = trials::get(db, trial).await?.study_id;
        if accessible_studies::reaches(db, reach, study).await? {
            all.push(status(id, Some(study), state, None));
        }
    }
    for (trial, study) in explanations::requested(db, reach).await? {
        let id = JobId::Explanation(trial);
        let is_open = matches!(
            runners.scheduler.explaining(trial),
            ExplanationEffort::Ready | ExplanationEffort::None | ExplanationEffort::Running(_)
        );
        if is_open && all.iter().all(|job| job.id != id) {
            // Requests since the running explanation began.
            all.push(status(id, Some(study), JobState::Queued, None));
        }
    }
    for solve in solve_jobs::open(db, reach).await? {
        let state = if solve.worker.is_some() { JobState::Running } else { JobState::Queued };
        all.push(status(JobId::Solve(solve.trial_id), Some(solve.study_id), state, Some(solve)));
    }
    all.sort_by_key(|job| job.id);
    Ok(all)
}
