//! Certificates of gaits, as they were made.

use super::{Connection, StoreResult, StudyId, TrialId, json, now};
use gait_optimizer::certificate::{self, Certificate};
use sqlx::Row;
use std::collections::HashMap;

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

/// What the record has of the certificate of a converged gait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CertificateOnRecord {
    /// The gait passed.
    Passed,
    /// The gait failed.
    Failed,
    /// The gait is there and was not certified yet.
    NotCertified,
    /// There is no gait to certify.
    Pruned,
}

/// The certificates of the converged trials of a study, by the present examination.
///
/// # Errors
/// What the database reports.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<HashMap<TrialId, CertificateOnRecord>> {
    let rows = sqlx::query(
        "select t.id, c.passed, exists (select 1 from gaits g where g.trial_id = t.id) as here from trials t \
         left join certificates c on c.trial_id = t.id and c.format_version = ?2 \
         where t.study_id = ?1 and t.state = 'converged'",
    )
    .bind(study)
    .bind(certificate::FORMAT_VERSION)
    .fetch_all(db)
    .await?;
    rows.iter()
        .map(|row| {
            let found = match (row.try_get::<Option<bool>, _>("passed")?, row.try_get("here")?) {
                (Some(true), _) => CertificateOnRecord::Passed,
                (Some(false), _) => CertificateOnRecord::Failed,
                (None, true) => CertificateOnRecord::NotCertified,
                (None, false) => CertificateOnRecord::Pruned,
            };
            Ok((row.try_get("id")?, found))
        })
        .collect()
}
