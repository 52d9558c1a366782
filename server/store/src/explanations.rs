//! Stored infeasibility explanations, and requests for them.

use super::accessible_studies::{reach_values, reached};
use super::audit::Actor;
use super::{Connection, Instant, StoreResult, StudyId, TrialId, json_columns, now};
use crate::accessible_studies::Reach;
use gait_optimizer::explanation::Explanation;
use sqlx::Row;
use std::collections::BTreeSet;

/// The change in the audit trail that requests an explanation.
pub const REQUESTED: &str = "trial.request_explanation";

/// A stored explanation.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredExplanation {
    /// Version of the program that made it.
    pub program: String,
    /// SHA-256 of the trial's `problem.json`.
    pub problem_sha256: String,
    /// The explanation.
    pub explanation: Explanation,
    /// Time of creation.
    pub created_at: Instant,
}

/// The explanation of a trial, if there is one: the one that was not stopped early, or else the newest.
///
/// # Errors
/// Errors of the database.
pub async fn find(db: &mut Connection, trial: TrialId) -> StoreResult<Option<StoredExplanation>> {
    let sql = "select * from explanations where trial_id = ? order by stopped_early, created_at desc limit 1";
    let row = sqlx::query(sql).bind(trial).fetch_optional(db).await?;
    row.map(|row| {
        Ok(StoredExplanation {
            program: row.try_get("program")?,
            problem_sha256: row.try_get("problem_sha256")?,
            explanation: json_columns::column(&row, "document")?,
            created_at: row.try_get("created_at")?,
        })
    })
    .transpose()
}

/// Stores an explanation. Returns `false` if the trial has a complete one already, which is kept.
///
/// # Errors
/// Errors of the database.
pub async fn insert(
    db: &mut Connection,
    trial: TrialId,
    problem: &str,
    explanation: &Explanation,
) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into explanations \
         (trial_id, stopped_early, program, problem_sha256, relaxed_bound, document, created_at) \
         select ?1, ?2, ?3, ?4, ?5, ?6, ?7 where not exists \
         (select 1 from explanations where trial_id = ?1 and stopped_early = 0) on conflict do nothing",
    )
    .bind(trial)
    .bind(explanation.stopped_early)
    .bind(Actor::program().as_str())
    .bind(json_columns::sha256(problem.as_bytes()))
    .bind(explanation.relief().map(|relaxation| relaxation.bound.as_str()))
    .bind(json_columns::to_text("explanation", explanation)?)
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() > 0)
}

/// Records a request for the explanation of a trial. Returns `false` if there was one already.
///
/// # Errors
/// Errors of the database.
pub async fn request(db: &mut Connection, trial: TrialId, actor: &Actor) -> StoreResult<bool> {
    let sql = "insert into explanation_requests (trial_id, actor, created_at) values (?, ?, ?) on conflict do nothing";
    let done = sqlx::query(sql).bind(trial).bind(actor.as_str()).bind(now()).execute(db).await?;
    Ok(done.rows_affected() > 0)
}

/// Whether the explanation of a trial was requested.
///
/// # Errors
/// Errors of the database.
pub async fn is_requested(db: &mut Connection, trial: TrialId) -> StoreResult<bool> {
    let found = sqlx::query("select 1 from explanation_requests where trial_id = ?").bind(trial).fetch_optional(db);
    Ok(found.await?.is_some())
}

/// The trials with a requested explanation that is not complete yet, and their studies, oldest request first. Only studies
/// that the caller can access, of subjects who have not withdrawn consent.
///
/// # Errors
/// Errors of the database.
pub async fn requested(db: &mut Connection, reach: Reach) -> StoreResult<Vec<(TrialId, StudyId)>> {
    let (every, open, principal) = reach_values(reach);
    let rows = sqlx::query(concat!(
        "select r.trial_id, t.study_id from explanation_requests r join trials t on t.id = r.trial_id \
         join studies s on s.id = t.study_id \
         where r.trial_id not in (select trial_id from explanations where stopped_early = 0) \
         and s.subject_id not in (select subject_id from withdrawn_subjects) and ",
        reached!("t.study_id"),
        " order by r.created_at, r.trial_id"
    ))
    .bind(every)
    .bind(open)
    .bind(principal)
    .fetch_all(db)
    .await?;
    rows.iter().map(|row| Ok((row.try_get("trial_id")?, row.try_get("study_id")?))).collect()
}

/// The first trial of an ended study that did not converge, can be explained and has no complete explanation, except those
/// in `refused`. `None` if the subject withdrew consent.
///
/// # Errors
/// Errors of the database.
pub async fn next_of_ended(
    db: &mut Connection,
    study: StudyId,
    refused: &BTreeSet<TrialId>,
) -> StoreResult<Option<TrialId>> {
    Ok(sqlx::query_scalar(
        "select t.id from trials t join studies s on s.id = t.study_id \
         where t.study_id = ? and t.state = 'not_converged' and t.script is null \
         and s.state in ('finished', 'stopped') \
         and t.id in (select trial_id from gaits) and t.id not in (select trial_id from explanations where stopped_early = 0) \
         and t.id not in (select value from json_each(?)) \
         and s.subject_id not in (select subject_id from withdrawn_subjects) \
         order by t.number limit 1",
    )
    .bind(study)
    .bind(json_columns::to_text("trials", refused)?)
    .fetch_optional(db)
    .await?)
}

/// Summary of the explanations of a study.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Common {
    /// Number of explained trials.
    pub explained: u32,
    /// The tuned bound that, relaxed alone, gives a gait most often.
    pub relief: Option<Relief>,
}

/// A bound whose relaxation gives a gait.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Relief {
    /// Name of the bound.
    pub bound: String,
    /// Number of trials in which its relaxation is the smallest one that does.
    pub trials: u32,
    /// Identifier and number of the first of these trials.
    pub instance: (TrialId, u32),
}

/// Summary of the complete explanations of a study.
///
/// # Errors
/// Errors of the database.
pub async fn in_common(db: &mut Connection, study: StudyId) -> StoreResult<Common> {
    let rows = sqlx::query(
        "select e.relaxed_bound, count(*) as trials, min(t.number) as number, t.id from explanations e \
         join trials t on t.id = e.trial_id where t.study_id = ? and e.stopped_early = 0 group by e.relaxed_bound \
         order by trials desc, e.relaxed_bound",
    )
    .bind(study)
    .fetch_all(db)
    .await?;
    let mut common = Common::default();
    for row in rows {
        let trials: u32 = row.try_get("trials")?;
        common.explained += trials;
        let bound: Option<String> = row.try_get("relaxed_bound")?;
        if let (None, Some(bound)) = (&common.relief, bound) {
            common.relief = Some(Relief { bound, trials, instance: (row.try_get("id")?, row.try_get("number")?) });
        }
    }
    Ok(common)
}
