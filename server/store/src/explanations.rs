//! Explanations of trials without a gait, as they were made, and who asked for them.

use super::audit::Actor;
use super::{Connection, Instant, StoreResult, StudyId, TrialId, json, now};
use gait_optimizer::explanation::Explanation;
use sqlx::Row;
use std::collections::BTreeSet;

/// An explanation as it was made.
#[derive(Debug, Clone, PartialEq)]
pub struct Explained {
    /// Which version of the program made it.
    pub program: String,
    /// SHA-256 of the problem that it was made from, as the problem's file gives it.
    pub problem_sha256: String,
    /// What was found.
    pub explanation: Explanation,
    /// When.
    pub created_at: Instant,
}

/// The explanation of a trial, if it was made.
///
/// # Errors
/// What the database reports.
pub async fn find(db: &mut Connection, trial: TrialId) -> StoreResult<Option<Explained>> {
    let row = sqlx::query("select * from explanations where trial_id = ?").bind(trial).fetch_optional(db).await?;
    row.map(|row| {
        Ok(Explained {
            program: row.try_get("program")?,
            problem_sha256: row.try_get("problem_sha256")?,
            explanation: json::column(&row, "document")?,
            created_at: row.try_get("created_at")?,
        })
    })
    .transpose()
}

/// Keeps what this program found out about a problem. `false` when the trial had an explanation: that one stays.
///
/// # Errors
/// What the database reports.
pub async fn keep(db: &mut Connection, trial: TrialId, problem: &str, explanation: &Explanation) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into explanations (trial_id, program, problem_sha256, relieved_by, document, created_at) \
         values (?, ?, ?, ?, ?, ?) on conflict do nothing",
    )
    .bind(trial)
    .bind(Actor::program().as_str())
    .bind(json::sha256(problem.as_bytes()))
    .bind(explanation.relief().map(|relaxation| relaxation.bound.as_str()))
    .bind(json::to_text("explanation", explanation)?)
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() > 0)
}

/// Writes down that somebody asks for the explanation of a trial. `false` when somebody did before.
///
/// # Errors
/// What the database reports.
pub async fn request(db: &mut Connection, trial: TrialId, actor: &Actor) -> StoreResult<bool> {
    let sql = "insert into explanation_requests (trial_id, actor, created_at) values (?, ?, ?) on conflict do nothing";
    let done = sqlx::query(sql).bind(trial).bind(actor.as_str()).bind(now()).execute(db).await?;
    Ok(done.rows_affected() > 0)
}

/// Whether somebody asked for the explanation of a trial.
///
/// # Errors
/// What the database reports.
pub async fn is_requested(db: &mut Connection, trial: TrialId) -> StoreResult<bool> {
    let found = sqlx::query("select 1 from explanation_requests where trial_id = ?").bind(trial).fetch_optional(db);
    Ok(found.await?.is_some())
}

/// The trial whose explanation was asked for first, of those that have none and whose subjects did not withdraw; none of
/// `refused`.
///
/// # Errors
/// What the database reports.
pub async fn next_requested(db: &mut Connection, refused: &BTreeSet<TrialId>) -> StoreResult<Option<TrialId>> {
    Ok(sqlx::query_scalar(
        "select r.trial_id from explanation_requests r join trials t on t.id = r.trial_id \
         join studies s on s.id = t.study_id \
         where r.trial_id not in (select trial_id from explanations) \
         and r.trial_id not in (select value from json_each(?)) \
         and s.subject_id not in (select subject_id from withdrawn_subjects) \
         order by r.created_at, r.trial_id limit 1",
    )
    .bind(json::to_text("trials", refused)?)
    .fetch_optional(db)
    .await?)
}

/// The first trial without a gait of a study that has ended and whose subject did not withdraw, of those that the program
/// solved, whose last iterates are kept and that have no explanation; none of `refused`.
///
/// # Errors
/// What the database reports.
pub async fn next_of_ended(
    db: &mut Connection,
    study: StudyId,
    refused: &BTreeSet<TrialId>,
) -> StoreResult<Option<TrialId>> {
    Ok(sqlx::query_scalar(
        "select t.id from trials t join studies s on s.id = t.study_id \
         where t.study_id = ? and t.state = 'not_converged' and t.asked_by is null \
         and s.state in ('finished', 'stopped') \
         and t.id in (select trial_id from gaits) and t.id not in (select trial_id from explanations) \
         and t.id not in (select value from json_each(?)) \
         and s.subject_id not in (select subject_id from withdrawn_subjects) \
         order by t.number limit 1",
    )
    .bind(study)
    .bind(json::to_text("trials", refused)?)
    .fetch_optional(db)
    .await?)
}

/// What the explanations of a study have in common.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Common {
    /// How many trials are explained.
    pub explained: u32,
    /// The tuned bound that, relaxed alone, gives a gait most often.
    pub relief: Option<Relief>,
}

/// A bound that gives a gait.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Relief {
    /// `a1`..`a8`.
    pub bound: String,
    /// In how many trials its relaxation is the smallest one that does.
    pub trials: u32,
    /// The first of them: identifier and number.
    pub instance: (TrialId, u32),
}

/// What the explanations of a study have in common.
///
/// # Errors
/// What the database reports.
pub async fn in_common(db: &mut Connection, study: StudyId) -> StoreResult<Common> {
    let rows = sqlx::query(
        "select e.relieved_by, count(*) as trials, min(t.number) as number, t.id from explanations e \
         join trials t on t.id = e.trial_id where t.study_id = ? group by e.relieved_by \
         order by trials desc, e.relieved_by",
    )
    .bind(study)
    .fetch_all(db)
    .await?;
    let mut common = Common::default();
    for row in rows {
        let trials: u32 = row.try_get("trials")?;
        common.explained += trials;
        let bound: Option<String> = row.try_get("relieved_by")?;
        if let (None, Some(bound)) = (&common.relief, bound) {
            common.relief = Some(Relief { bound, trials, instance: (row.try_get("id")?, row.try_get("number")?) });
        }
    }
    Ok(common)
}
