//! Stored execution reports of gaits, and requests for them.
//!
//! A report is the payload of an event of its study. The audit trail holds the requests, so a request that was
//! acknowledged outlives the process.

use super::{Connection, Instant, StoreResult, TrialId, json_columns};
use gait_optimizer::execution::{self, ExecutionReport};
use serde::{Deserialize, Serialize};
use sqlx::Row;

/// Kind of the event with a report.
pub const REPORTED: &str = "execution_reported";
/// The change in the audit trail that requests a report.
pub const REQUESTED: &str = "trial.request_execution_report";
/// The change in the audit trail that stores a report.
pub const STORED: &str = "trial.report_execution";

/// Payload of the event with a report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExecutionReported {
    /// Identifier of the trial.
    pub trial_id: TrialId,
    /// Its number.
    pub number: u32,
    /// Number of simulated walks on each kind of ground.
    pub number_of_simulated_walks: u32,
    /// Seed of the disturbances.
    pub seed: u64,
    /// Version of the program that made the report.
    pub program: String,
    /// The report.
    pub report: ExecutionReport,
}

/// A stored report.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredReport {
    /// The payload of its event.
    pub reported: ExecutionReported,
    /// Time of the event.
    pub created_at: Instant,
}

/// The newest report of a trial's gait in the current format, if there is one.
///
/// # Errors
/// Errors of the database.
pub async fn newest(db: &mut Connection, trial: TrialId) -> StoreResult<Option<StoredReport>> {
    let row = sqlx::query(
        "select e.payload, e.created_at from trials t join events e on e.study_id = t.study_id \
         where t.id = ?1 and e.kind = ?2 and json_extract(e.payload, '$.trial_id') = ?1 \
         and json_extract(e.payload, '$.report.format_version') = ?3 order by e.seq desc limit 1",
    )
    .bind(trial)
    .bind(REPORTED)
    .bind(execution::FORMAT_VERSION)
    .fetch_optional(db)
    .await?;
    row.map(|row| {
        Ok(StoredReport { reported: json_columns::column(&row, "payload")?, created_at: row.try_get("created_at")? })
    })
    .transpose()
}

/// Trials whose reports were requested and not stored since, with the numbers of walks and the seeds, oldest request
/// first.
///
/// # Errors
/// Errors of the database.
pub async fn requested(db: &mut Connection) -> StoreResult<Vec<(TrialId, u32, u64)>> {
    let rows = sqlx::query(
        "select t.id, json_extract(a.detail, '$.number_of_simulated_walks') as number_of_simulated_walks, json_extract(a.detail, '$.seed') as seed \
         from audit a join trials t on t.id = substr(a.object, 1 + length('trial ')) where a.change = ?1 \
         and not exists (select 1 from audit c where c.seq > a.seq and c.object = a.object and c.change in (?1, ?2)) \
         order by a.seq",
    )
    .bind(REQUESTED)
    .bind(STORED)
    .fetch_all(db)
    .await?;
    rows.iter()
        .map(|row| {
            // Seeds of requests are at most 2^53.
            let seed: i64 = row.try_get("seed")?;
            Ok((row.try_get("id")?, row.try_get("number_of_simulated_walks")?, seed.cast_unsigned()))
        })
        .collect()
}
