//! Cancelled jobs of trials. The audit trail holds the cancellations, so a cancelled job stays cancelled after a restart.

use super::{Connection, StoreResult, TrialId};

/// The change in the audit trail that cancels a job.
pub const CANCELLED: &str = "job.cancel";

/// The trials whose jobs of a kind, the beginning of their identifiers, were cancelled and not requested since.
/// `requested` is the change in the audit trail that requests such a job.
///
/// # Errors
/// Errors of the database.
pub async fn trials(db: &mut Connection, kind: &str, requested: &str) -> StoreResult<Vec<TrialId>> {
    let sql = "select distinct t.id from audit c join trials t on t.id = substr(c.object, length('job ' || ?1 || '-') + 1) \
               where c.change = ?2 and c.object = 'job ' || ?1 || '-' || t.id and not exists (select 1 from audit r \
               where r.seq > c.seq and r.change = ?3 and r.object = 'trial ' || t.id) order by t.id";
    Ok(sqlx::query_scalar(sql).bind(kind).bind(CANCELLED).bind(requested).fetch_all(db).await?)
}
