//! Certificates of gaits, as they were made.

use super::{Connection, StoreResult, TrialId, json, now};
use gait_optimizer::certificate::{self, Certificate};
use sqlx::Row;

/// The certificate of a trial's gait by the present examination, if it was made.
///
/// # Errors
/// What the database reports.
pub async fn find(db: &mut Connection, trial: TrialId) -> StoreResult<Option<Certificate>> {
    sqlx::query("select document from certificates where trial_id = ? and format_version = ?")
        .bind(trial)
        .bind(certificate::FORMAT_VERSION)
        .fetch_optional(db)
        .await?
        .map(|row| json::from_text("certificate", row.try_get("document")?))
        .transpose()
}

/// Whether a trial's gait passed the present examination, if it was made.
///
/// # Errors
/// What the database reports.
pub async fn passed(db: &mut Connection, trial: TrialId) -> StoreResult<Option<bool>> {
    Ok(sqlx::query_scalar("select passed from certificates where trial_id = ? and format_version = ?")
        .bind(trial)
        .bind(certificate::FORMAT_VERSION)
        .fetch_optional(db)
        .await?)
}

/// Keeps a certificate. `false` when there was one: it is deterministic, so both are the same.
///
/// # Errors
/// What the database reports.
pub async fn keep(db: &mut Connection, trial: TrialId, certificate: &Certificate) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into certificates (trial_id, format_version, passed, document, created_at) values (?, ?, ?, ?, ?) \
         on conflict do nothing",
    )
    .bind(trial)
    .bind(certificate.format_version)
    .bind(certificate.passed)
    .bind(json::to_text("certificate", certificate)?)
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() > 0)
}
