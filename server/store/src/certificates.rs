//! Stored certificates of gaits.

use super::{Connection, StoreResult, StudyId, TrialId, json_columns, now};
use gait_optimizer::certificate::{self, Certificate};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Row};
use std::collections::HashMap;

/// The certificate of a trial's gait in the current format, if there is one.
///
/// # Errors
/// Errors of the database.
pub async fn find(db: &mut Connection, trial: TrialId) -> StoreResult<Option<Certificate>> {
    sqlx::query("select document from certificates where trial_id = ? and format_version = ?")
        .bind(trial)
        .bind(certificate::FORMAT_VERSION)
        .fetch_optional(db)
        .await?
        .map(|row| json_columns::from_text("certificate", row.try_get("document")?))
        .transpose()
}

/// The certificate in the current format of any trial with the same gait as this one, bit for bit.
///
/// # Errors
/// Errors of the database.
pub async fn of_same_gait(db: &mut Connection, trial: TrialId) -> StoreResult<Option<Certificate>> {
    let sql = "select c.document from gaits own join gaits g on g.gait_sha256 = own.gait_sha256 \
               join certificates c on c.trial_id = g.trial_id and c.format_version = ?2 where own.trial_id = ?1 limit 1";
    sqlx::query(sql)
        .bind(trial)
        .bind(certificate::FORMAT_VERSION)
        .fetch_optional(db)
        .await?
        .map(|row| json_columns::from_text("certificate", row.try_get("document")?))
        .transpose()
}

/// Whether the certificate of a trial's gait passed, if there is one.
///
/// # Errors
/// Errors of the database.
pub async fn passed(db: &mut Connection, trial: TrialId) -> StoreResult<Option<bool>> {
    Ok(sqlx::query_scalar("select passed from certificates where trial_id = ? and format_version = ?")
        .bind(trial)
        .bind(certificate::FORMAT_VERSION)
        .fetch_optional(db)
        .await?)
}

/// Stores a certificate. Returns `false` if there was one already, which is identical because certification is
/// deterministic.
///
/// # Errors
/// Errors of the database.
pub async fn insert(db: &mut Connection, trial: TrialId, certificate: &Certificate) -> StoreResult<bool> {
    let done = sqlx::query(
        "insert into certificates (trial_id, format_version, passed, document, created_at) values (?, ?, ?, ?, ?) \
         on conflict do nothing",
    )
    .bind(trial)
    .bind(certificate.format_version)
    .bind(certificate.passed)
    .bind(json_columns::to_text("certificate", certificate)?)
    .bind(now())
    .execute(db)
    .await?;
    Ok(done.rows_affected() > 0)
}

/// Trials whose certificates were requested and not made since. The audit trail holds the requests, so a request that
/// was acknowledged outlives the process.
///
/// # Errors
/// Errors of the database.
pub async fn requested(db: &mut Connection) -> StoreResult<Vec<TrialId>> {
    let sql = "select distinct t.id from audit a join trials t on t.id = substr(a.object, 1 + length('trial ')) \
               where a.change = ?1 and t.state = 'converged' \
               and not exists (select 1 from certificates c where c.trial_id = t.id and c.format_version = ?2) \
               order by t.id";
    Ok(sqlx::query_scalar(sql).bind(REQUESTED).bind(certificate::FORMAT_VERSION).fetch_all(db).await?)
}

/// The change in the audit trail that requests a certificate.
pub const REQUESTED: &str = "trial.request_certificate";

/// State of the certificate of a converged gait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CertificateOnRecord {
    /// The gait passed.
    Passed,
    /// The gait failed.
    Failed,
    /// The gait has no certificate yet.
    NotCertified,
    /// The gait was pruned before it was certified.
    Pruned,
}

/// The states of the certificates of all converged trials of a study.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId) -> StoreResult<HashMap<TrialId, CertificateOnRecord>> {
    let sql = AssertSqlSafe(format!("{SELECT} where t.study_id = ?2 and t.state = 'converged'"));
    let rows = sqlx::query(sql).bind(certificate::FORMAT_VERSION).bind(study).fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

/// The states of the certificates of a few trials, without those that have not converged.
///
/// # Errors
/// Errors of the database.
pub async fn of_trials(db: &mut Connection, trials: &[TrialId]) -> StoreResult<HashMap<TrialId, CertificateOnRecord>> {
    let sql =
        AssertSqlSafe(format!("{SELECT} where t.id in (select value from json_each(?2)) and t.state = 'converged'"));
    let trials = json_columns::to_text("trials", &trials)?;
    let rows = sqlx::query(sql).bind(certificate::FORMAT_VERSION).bind(trials).fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

/// Selects trials with the results of their certificates.
const SELECT: &str = "select t.id, c.passed, exists (select 1 from gaits g where g.trial_id = t.id) as here \
                      from trials t left join certificates c on c.trial_id = t.id and c.format_version = ?1 ";

fn from_row(row: &SqliteRow) -> StoreResult<(TrialId, CertificateOnRecord)> {
    let found = match (row.try_get::<Option<bool>, _>("passed")?, row.try_get("here")?) {
        (Some(true), _) => CertificateOnRecord::Passed,
        (Some(false), _) => CertificateOnRecord::Failed,
        (None, true) => CertificateOnRecord::NotCertified,
        (None, false) => CertificateOnRecord::Pruned,
    };
    Ok((row.try_get("id")?, found))
}
