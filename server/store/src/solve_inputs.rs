//! The inputs of the solves of this service: a trial with the input of an earlier one takes its result.

use super::{Connection, StoreResult, TrialId};

/// Keeps that the trial has the result of the solve with this input. If an earlier trial had it and its gait was deleted,
/// the new trial replaces it.
///
/// # Errors
/// Errors of the database.
pub async fn put(db: &mut Connection, sha256: &str, trial: TrialId) -> StoreResult<()> {
    sqlx::query(
        "insert into solve_inputs (sha256, trial_id) values (?, ?) on conflict (sha256) do update set trial_id = excluded.trial_id \
         where not exists (select 1 from gaits g where g.trial_id = solve_inputs.trial_id)",
    )
    .bind(sha256)
    .bind(trial)
    .execute(db)
    .await?;
    Ok(())
}

/// The trial with the result of the solve with this input, if the record has its gait.
///
/// # Errors
/// Errors of the database.
pub async fn solved(db: &mut Connection, sha256: &str) -> StoreResult<Option<TrialId>> {
    let sql = "select i.trial_id from solve_inputs i join gaits g on g.trial_id = i.trial_id where i.sha256 = ?";
    Ok(sqlx::query_scalar(sql).bind(sha256).fetch_optional(db).await?)
}
