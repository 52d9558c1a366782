//! Solve jobs: the queue of solves, with leases.
//!
//! `attempts` is a fencing token: a result counts only if it has the number of the current attempt and the job is still
//! leased. Late and repeated results are therefore never recorded twice.

use super::accessible_studies::{reach_values, reached};
use super::{Connection, Instant, SolveJobId, StoreError, StoreResult, StudyId, TrialId, now};
use crate::accessible_studies::Reach;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use std::collections::BTreeMap;

/// The exclusive right to run a job until the lease expires.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lease {
    /// The job.
    pub job: SolveJobId,
    /// Its trial.
    pub trial: TrialId,
    /// Its study.
    pub study: StudyId,
    /// Number of this attempt, from 1.
    pub attempt: u32,
}

/// Numbers of failures of a job so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FailureCounts {
    /// Number of panics and errors.
    pub failures: u32,
    /// Number of workers that stopped responding.
    pub losses: u32,
}

/// A solve that has not ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OpenSolve {
    /// Its trial.
    pub trial_id: TrialId,
    /// Its study.
    pub study_id: StudyId,
    /// Number of times that it was given to a worker.
    pub attempts: u32,
    /// Attempts that crashed or ended with an error.
    pub failures: u32,
    /// Attempts whose worker stopped responding.
    pub losses: u32,
    /// Worker that has it. Null while it is queued.
    pub worker: Option<String>,
    /// End of the lease, unless it is renewed.
    pub lease_until: Option<Instant>,
    /// Time of queueing.
    pub created_at: Instant,
}

/// The solves that have not ended, of studies that a caller reaches.
///
/// # Errors
/// Errors of the database.
pub async fn open(db: &mut Connection, reach: Reach) -> StoreResult<Vec<OpenSolve>> {
    let (every, open, principal) = reach_values(reach);
    let rows = sqlx::query(concat!(
        "select j.*, t.study_id from solve_jobs j join trials t on t.id = j.trial_id where j.state <> 'done' and ",
        reached!("t.study_id")
    ))
    .bind(every)
    .bind(open)
    .bind(principal)
    .fetch_all(db)
    .await?;
    rows.iter().map(open_solve).collect()
}

/// The solve of a trial, unless it has ended.
///
/// # Errors
/// Errors of the database.
pub async fn open_of(db: &mut Connection, trial: TrialId) -> StoreResult<Option<OpenSolve>> {
    let sql = "select j.*, t.study_id from solve_jobs j join trials t on t.id = j.trial_id \
               where j.state <> 'done' and j.trial_id = ?";
    sqlx::query(sql).bind(trial).fetch_optional(db).await?.as_ref().map(open_solve).transpose()
}

fn open_solve(row: &SqliteRow) -> StoreResult<OpenSolve> {
    Ok(OpenSolve {
        trial_id: row.try_get("trial_id")?,
        study_id: row.try_get("study_id")?,
        attempts: row.try_get("attempts")?,
        failures: row.try_get("failures")?,
        losses: row.try_get("losses")?,
        worker: row.try_get("worker")?,
        lease_until: row.try_get("lease_until")?,
        created_at: row.try_get("created_at")?,
    })
}

/// How many solves each worker has.
///
/// # Errors
/// Errors of the database.
pub async fn by_worker(db: &mut Connection) -> StoreResult<BTreeMap<String, u32>> {
    let sql = "select worker, count(*) as solves from solve_jobs where state <> 'done' and worker is not null group by worker";
    let rows = sqlx::query(sql).fetch_all(db).await?;
    rows.iter().map(|row| Ok((row.try_get("worker")?, row.try_get("solves")?))).collect()
}

/// Queues the solve of a trial.
///
/// # Errors
/// A violated constraint (`solve_jobs_trial_unique`); errors of the database.
pub async fn insert(db: &mut Connection, trial: TrialId) -> StoreResult<()> {
    sqlx::query("insert into solve_jobs (id, trial_id, state, created_at) values (?, ?, 'queued', ?)")
        .bind(SolveJobId::fresh())
        .bind(trial)
        .bind(now())
        .execute(db)
        .await?;
    Ok(())
}

/// Leases the next job: the one with the highest priority, then from the study with the fewest running jobs, then the
/// oldest. With `only`, from that study. `None` if there is none, or if `most` jobs are already leased.
///
/// # Errors
/// Errors of the database.
pub async fn lease(
    db: &mut Connection,
    worker: &str,
    until: Instant,
    only: Option<StudyId>,
    most: usize,
) -> StoreResult<Option<Lease>> {
    let (_, out) = depth(db).await?;
    if out as usize >= most {
        return Ok(None);
    }
    let row = sqlx::query(
        "select j.id, j.trial_id, j.attempts, t.study_id from solve_jobs j \
         join trials t on t.id = j.trial_id join studies s on s.id = t.study_id \
         where j.state = 'queued' and s.state in ('running', 'waiting') and (? is null or s.id = ?) \
         order by s.priority desc, \
         (select count(*) from solve_jobs k join trials u on u.id = k.trial_id \
          where k.state = 'leased' and u.study_id = t.study_id), j.created_at, j.id limit 1",
    )
    .bind(only)
    .bind(only)
    .fetch_optional(&mut *db)
    .await?;
    let Some(row) = row else { return Ok(None) };
    let lease = Lease {
        job: row.try_get("id")?,
        trial: row.try_get("trial_id")?,
        study: row.try_get("study_id")?,
        attempt: row.try_get::<u32, _>("attempts")? + 1,
    };
    sqlx::query("update solve_jobs set state = 'leased', attempts = ?, worker = ?, lease_until = ? where id = ?")
        .bind(lease.attempt)
        .bind(worker)
        .bind(until)
        .bind(lease.job)
        .execute(db)
        .await?;
    Ok(Some(lease))
}

/// The lease of an attempt at a trial, whether it is still valid or not.
///
/// # Errors
/// [`StoreError::Missing`] if the trial has no job; errors of the database.
pub async fn lease_of(db: &mut Connection, trial: TrialId, attempt: u32) -> StoreResult<Lease> {
    let row = sqlx::query(
        "select j.id, t.study_id from solve_jobs j join trials t on t.id = j.trial_id where j.trial_id = ?",
    )
    .bind(trial)
    .fetch_optional(db)
    .await?
    .ok_or_else(|| StoreError::Missing { what: "job for trial", id: trial.to_string() })?;
    Ok(Lease { job: row.try_get("id")?, trial, study: row.try_get("study_id")?, attempt })
}

/// Renews a lease. Returns `false` if it has passed to another attempt.
///
/// # Errors
/// Errors of the database.
pub async fn heartbeat(db: &mut Connection, lease: &Lease, until: Instant) -> StoreResult<bool> {
    let done = sqlx::query("update solve_jobs set lease_until = ? where id = ? and attempts = ? and state = 'leased'")
        .bind(until)
        .bind(lease.job)
        .bind(lease.attempt)
        .execute(db)
        .await?;
    Ok(done.rows_affected() == 1)
}

/// Ends a job. Returns `false` if the lease has passed to another attempt; the caller must not record anything then.
///
/// # Errors
/// Errors of the database.
pub async fn finish(db: &mut Connection, lease: &Lease) -> StoreResult<bool> {
    let done = sqlx::query(
        "update solve_jobs set state = 'done', worker = null, lease_until = null \
         where id = ? and attempts = ? and state = 'leased'",
    )
    .bind(lease.job)
    .bind(lease.attempt)
    .execute(db)
    .await?;
    Ok(done.rows_affected() == 1)
}

/// Ends the job of a cancelled trial, in any state.
///
/// # Errors
/// Errors of the database.
pub async fn cancel(db: &mut Connection, trial: TrialId) -> StoreResult<()> {
    sqlx::query("update solve_jobs set state = 'done', worker = null, lease_until = null where trial_id = ?")
        .bind(trial)
        .execute(db)
        .await?;
    Ok(())
}

/// Queues a job again and stores its numbers of failures.
///
/// # Errors
/// Errors of the database.
pub async fn requeue(db: &mut Connection, job: SolveJobId, failure_counts: FailureCounts) -> StoreResult<()> {
    sqlx::query(
        "update solve_jobs set state = 'queued', worker = null, lease_until = null, failures = ?, losses = ? where id = ?",
    )
    .bind(failure_counts.failures)
    .bind(failure_counts.losses)
    .bind(job)
    .execute(db)
    .await?;
    Ok(())
}

/// Queues the job of an ended trial again.
///
/// # Errors
/// Errors of the database.
pub async fn reopen(db: &mut Connection, trial: TrialId) -> StoreResult<()> {
    sqlx::query(
        "update solve_jobs set state = 'queued', failures = 0, losses = 0 where trial_id = ? and state = 'done'",
    )
    .bind(trial)
    .execute(db)
    .await?;
    Ok(())
}

/// The numbers of failures of a job.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn failure_counts(db: &mut Connection, job: SolveJobId) -> StoreResult<FailureCounts> {
    let row = sqlx::query("select failures, losses from solve_jobs where id = ?")
        .bind(job)
        .fetch_optional(db)
        .await?
        .ok_or_else(|| StoreError::Missing { what: "job", id: job.to_string() })?;
    Ok(FailureCounts { failures: row.try_get("failures")?, losses: row.try_get("losses")? })
}

/// Leases that expired before `at`.
///
/// # Errors
/// Errors of the database.
pub async fn expired(db: &mut Connection, at: Instant) -> StoreResult<Vec<Lease>> {
    leases(
        &sqlx::query(
            "select j.id, j.trial_id, j.attempts, t.study_id from solve_jobs j join trials t on t.id = j.trial_id \
             where j.state = 'leased' and j.lease_until < ? order by j.id",
        )
        .bind(at)
        .fetch_all(db)
        .await?,
    )
}

/// Leases of inactive studies whose solves have not started.
///
/// # Errors
/// Errors of the database.
pub async fn unstarted_of_inactive_studies(db: &mut Connection) -> StoreResult<Vec<Lease>> {
    leases(
        &sqlx::query(
            "select j.id, j.trial_id, j.attempts, t.study_id from solve_jobs j join trials t on t.id = j.trial_id \
             join studies s on s.id = t.study_id \
             where j.state = 'leased' and t.state = 'queued' and s.state not in ('running', 'waiting') order by j.id",
        )
        .fetch_all(db)
        .await?,
    )
}

/// Every lease of an engine. At the start, these are leftovers of an earlier process.
///
/// # Errors
/// Errors of the database.
pub async fn leased(db: &mut Connection, engine: Option<&str>) -> StoreResult<Vec<Lease>> {
    leases(
        &sqlx::query(
            "select j.id, j.trial_id, j.attempts, t.study_id from solve_jobs j join trials t on t.id = j.trial_id \
             where j.state = 'leased' and (? is null or j.worker = ?) order by j.id",
        )
        .bind(engine)
        .bind(engine)
        .fetch_all(db)
        .await?,
    )
}

/// The numbers of queued and leased jobs over all studies.
///
/// # Errors
/// Errors of the database.
pub async fn depth(db: &mut Connection) -> StoreResult<(u32, u32)> {
    let row = sqlx::query(
        "select (select count(*) from solve_jobs where state = 'queued') as queued, \
                (select count(*) from solve_jobs where state = 'leased') as leased",
    )
    .fetch_one(db)
    .await?;
    Ok((row.try_get("queued")?, row.try_get("leased")?))
}

/// The numbers of queued and leased jobs of other studies than this one.
///
/// # Errors
/// Errors of the database.
pub async fn depth_of_others(db: &mut Connection, study: StudyId) -> StoreResult<(u32, u32)> {
    let row = sqlx::query(
        "select coalesce(sum(j.state = 'queued'), 0) as queued, coalesce(sum(j.state = 'leased'), 0) as leased \
         from solve_jobs j join trials t on t.id = j.trial_id where j.state in ('queued', 'leased') and t.study_id <> ?",
    )
    .bind(study)
    .fetch_one(db)
    .await?;
    Ok((row.try_get("queued")?, row.try_get("leased")?))
}

fn leases(rows: &[SqliteRow]) -> StoreResult<Vec<Lease>> {
    rows.iter()
        .map(|row| {
            Ok(Lease {
                job: row.try_get("id")?,
                trial: row.try_get("trial_id")?,
                study: row.try_get("study_id")?,
                attempt: row.try_get("attempts")?,
            })
        })
        .collect()
}
