//! Jobs: the queue of solves, with leases.
//!
//! `attempts` is the fence: a result counts only when it carries the number of the current attempt and the
//! job is still leased, so that whatever arrives late or twice is recorded at most once.

use super::members::{binds, reached};
use super::{Connection, Instant, JobId, StoreError, StoreResult, StudyId, TrialId, now};
use crate::reach::Reach;
use serde::Serialize;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use utoipa::ToSchema;

/// The right to run a job, for as long as the lease is kept alive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lease {
    /// The job.
    pub job: JobId,
    /// Its trial.
    pub trial: TrialId,
    /// Its study.
    pub study: StudyId,
    /// Number of this attempt, from 1.
    pub attempt: u32,
}

/// How often a job went wrong so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Troubles {
    /// Panics and errors of the program.
    pub failures: u32,
    /// Workers that were not heard of again.
    pub losses: u32,
}

/// A job that is not done.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct Job {
    /// Its trial.
    pub trial_id: TrialId,
    /// Its study.
    pub study_id: StudyId,
    /// `queued`, or `leased` to a worker.
    pub state: String,
    /// How often a worker was to start it.
    pub attempts: u32,
    /// Of which ended by a panic or an error of the program.
    pub failures: u32,
    /// Of which ended by a worker that was not heard of again.
    pub losses: u32,
    /// Who has it.
    pub worker: Option<String>,
    /// Until when, without a sign of life.
    pub lease_until: Option<Instant>,
    /// When it was queued.
    pub created_at: Instant,
}

/// At most `limit` jobs that are not done, of studies that a caller reaches, in the order of queueing.
///
/// # Errors
/// What the database reports.
pub async fn open(db: &mut Connection, reach: Reach, limit: u32) -> StoreResult<Vec<Job>> {
    let (every, open, principal) = binds(reach);
    let rows = sqlx::query(concat!(
        "select j.*, t.study_id from jobs j join trials t on t.id = j.trial_id where j.state <> 'done' and ",
        reached!("t.study_id"),
        " order by j.created_at, j.id limit ?4"
    ))
    .bind(every)
    .bind(open)
    .bind(principal)
    .bind(limit)
    .fetch_all(db)
    .await?;
    rows.iter()
        .map(|row| {
            Ok(Job {
                trial_id: row.try_get("trial_id")?,
                study_id: row.try_get("study_id")?,
                state: row.try_get("state")?,
                attempts: row.try_get("attempts")?,
                failures: row.try_get("failures")?,
                losses: row.try_get("losses")?,
                worker: row.try_get("worker")?,
                lease_until: row.try_get("lease_until")?,
                created_at: row.try_get("created_at")?,
            })
        })
        .collect()
}

/// Queues the solve of a trial.
///
/// # Errors
/// A violated constraint (`jobs_trial_unique`), or what the database reports.
pub async fn insert(db: &mut Connection, trial: TrialId) -> StoreResult<()> {
    sqlx::query("insert into jobs (id, trial_id, state, created_at) values (?, ?, 'queued', ?)")
        .bind(JobId::fresh())
        .bind(trial)
        .bind(now())
        .execute(db)
        .await?;
    Ok(())
}

/// Leases the next job: highest priority first, then the study with the fewest running jobs, then the
/// oldest. With `only`, from that study. `None`: there is none, or `most` are leased already.
///
/// # Errors
/// What the database reports.
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
        "select j.id, j.trial_id, j.attempts, t.study_id from jobs j \
         join trials t on t.id = j.trial_id join studies s on s.id = t.study_id \
         where j.state = 'queued' and s.state in ('running', 'waiting') and (? is null or s.id = ?) \
         order by s.priority desc, \
         (select count(*) from jobs k join trials u on u.id = k.trial_id \
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
    sqlx::query("update jobs set state = 'leased', attempts = ?, worker = ?, lease_until = ? where id = ?")
        .bind(lease.attempt)
        .bind(worker)
        .bind(until)
        .bind(lease.job)
        .execute(db)
        .await?;
    Ok(Some(lease))
}

/// The lease of an attempt at a trial, whether it still holds or not.
///
/// # Errors
/// [`StoreError::Missing`] when the trial has no job, or what the database reports.
pub async fn lease_of(db: &mut Connection, trial: TrialId, attempt: u32) -> StoreResult<Lease> {
    let row =
        sqlx::query("select j.id, t.study_id from jobs j join trials t on t.id = j.trial_id where j.trial_id = ?")
            .bind(trial)
            .fetch_optional(db)
            .await?
            .ok_or_else(|| StoreError::Missing { what: "the job of trial", id: trial.to_string() })?;
    Ok(Lease { job: row.try_get("id")?, trial, study: row.try_get("study_id")?, attempt })
}

/// Keeps a lease alive. `false`: it is not ours any more.
///
/// # Errors
/// What the database reports.
pub async fn heartbeat(db: &mut Connection, lease: &Lease, until: Instant) -> StoreResult<bool> {
    let done = sqlx::query("update jobs set lease_until = ? where id = ? and attempts = ? and state = 'leased'")
        .bind(until)
        .bind(lease.job)
        .bind(lease.attempt)
        .execute(db)
        .await?;
    Ok(done.rows_affected() == 1)
}

/// Ends a job. `false`: the lease is not ours any more, and nothing may be recorded.
///
/// # Errors
/// What the database reports.
pub async fn finish(db: &mut Connection, lease: &Lease) -> StoreResult<bool> {
    let done = sqlx::query(
        "update jobs set state = 'done', worker = null, lease_until = null \
         where id = ? and attempts = ? and state = 'leased'",
    )
    .bind(lease.job)
    .bind(lease.attempt)
    .execute(db)
    .await?;
    Ok(done.rows_affected() == 1)
}

/// Ends the job of a trial, whatever its state (a person cancelled the trial).
///
/// # Errors
/// What the database reports.
pub async fn cancel(db: &mut Connection, trial: TrialId) -> StoreResult<()> {
    sqlx::query("update jobs set state = 'done', worker = null, lease_until = null where trial_id = ?")
        .bind(trial)
        .execute(db)
        .await?;
    Ok(())
}

/// Gives a job back to the queue and counts what went wrong.
///
/// # Errors
/// What the database reports.
pub async fn requeue(db: &mut Connection, job: JobId, troubles: Troubles) -> StoreResult<()> {
    sqlx::query(
        "update jobs set state = 'queued', worker = null, lease_until = null, failures = ?, losses = ? where id = ?",
    )
    .bind(troubles.failures)
    .bind(troubles.losses)
    .bind(job)
    .execute(db)
    .await?;
    Ok(())
}

/// Lets an ended trial run once more.
///
/// # Errors
/// What the database reports.
pub async fn reopen(db: &mut Connection, trial: TrialId) -> StoreResult<()> {
    sqlx::query("update jobs set state = 'queued', failures = 0, losses = 0 where trial_id = ? and state = 'done'")
        .bind(trial)
        .execute(db)
        .await?;
    Ok(())
}

/// How often the job of a lease went wrong so far.
///
/// # Errors
/// [`StoreError::Missing`], or what the database reports.
pub async fn troubles(db: &mut Connection, job: JobId) -> StoreResult<Troubles> {
    let row = sqlx::query("select failures, losses from jobs where id = ?")
        .bind(job)
        .fetch_optional(db)
        .await?
        .ok_or_else(|| StoreError::Missing { what: "job", id: job.to_string() })?;
    Ok(Troubles { failures: row.try_get("failures")?, losses: row.try_get("losses")? })
}

/// Leases that ran out before `at`.
///
/// # Errors
/// What the database reports.
pub async fn expired(db: &mut Connection, at: Instant) -> StoreResult<Vec<Lease>> {
    leases(
        &sqlx::query(
            "select j.id, j.trial_id, j.attempts, t.study_id from jobs j join trials t on t.id = j.trial_id \
             where j.state = 'leased' and j.lease_until < ? order by j.id",
        )
        .bind(at)
        .fetch_all(db)
        .await?,
    )
}

/// Leases of studies that do not go on, whose solves no worker began.
///
/// # Errors
/// What the database reports.
pub async fn held_up(db: &mut Connection) -> StoreResult<Vec<Lease>> {
    leases(
        &sqlx::query(
            "select j.id, j.trial_id, j.attempts, t.study_id from jobs j join trials t on t.id = j.trial_id \
             join studies s on s.id = t.study_id \
             where j.state = 'leased' and t.state = 'queued' and s.state not in ('running', 'waiting') order by j.id",
        )
        .fetch_all(db)
        .await?,
    )
}

/// Every lease that was given to an engine: at start, what an earlier process left behind.
///
/// # Errors
/// What the database reports.
pub async fn leased(db: &mut Connection, engine: Option<&str>) -> StoreResult<Vec<Lease>> {
    leases(
        &sqlx::query(
            "select j.id, j.trial_id, j.attempts, t.study_id from jobs j join trials t on t.id = j.trial_id \
             where j.state = 'leased' and (? is null or j.worker = ?) order by j.id",
        )
        .bind(engine)
        .bind(engine)
        .fetch_all(db)
        .await?,
    )
}

/// How many jobs wait and run, over all studies.
///
/// # Errors
/// What the database reports.
pub async fn depth(db: &mut Connection) -> StoreResult<(u32, u32)> {
    let row = sqlx::query(
        "select (select count(*) from jobs where state = 'queued') as queued, \
                (select count(*) from jobs where state = 'leased') as leased",
    )
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
