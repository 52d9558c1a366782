//! Stored gaits: trajectory, warm start and iterations of completed solves, compressed.

use super::{Connection, Packed, PackedText, StoreError, StoreResult, TrialId, json_columns, now};
use gait_optimizer::{Gait, IterationRecord, SolveOutcome, WarmStart};
use gaitwright_compute::OnPool;
use serde::de::DeserializeOwned;
use sqlx::Row;
use std::collections::HashSet;

/// A compressed gait, ready to be written.
#[derive(Debug)]
pub struct PackedGait {
    format_version: u32,
    speed_m_s: Option<f64>,
    stride_length_m: Option<f64>,
    stride_time_s: Option<f64>,
    gait: Vec<u8>,
    warm_start: Vec<u8>,
    iterations: Vec<u8>,
    sha256: String,
}

impl PackedGait {
    /// Serialises and compresses an outcome. `None` if it has numbers that are not finite, as after a diverging solve.
    ///
    /// # Errors
    /// If serialisation fails.
    pub fn new(pool: &OnPool, outcome: &SolveOutcome, iterations: &[IterationRecord]) -> StoreResult<Option<Self>> {
        let gait = json_columns::to_text("gait", &outcome.gait)?;
        let warm_start = json_columns::to_text("warm start", &outcome.warm_start)?;
        // JSON writes such numbers as null, which cannot be read back.
        if serde_json::from_str::<Gait>(&gait).is_err() || serde_json::from_str::<WarmStart>(&warm_start).is_err() {
            return Ok(None);
        }
        let finite: Vec<&IterationRecord> = iterations.iter().filter(|record| is_finite(record)).collect();
        Ok(Some(Self {
            format_version: outcome.gait.format_version,
            speed_m_s: Some(outcome.gait.speed_m_s),
            stride_length_m: Some(outcome.gait.stride_length_m),
            stride_time_s: Some(outcome.gait.stride_time_s),
            sha256: json_columns::sha256(gait.as_bytes()),
            gait: json_columns::compress(pool, "gait", gait.as_bytes())?,
            warm_start: json_columns::compress(pool, "warm start", warm_start.as_bytes())?,
            iterations: json_columns::compress(
                pool,
                "iterations",
                json_columns::to_text("iterations", &finite)?.as_bytes(),
            )?,
        }))
    }
}

fn is_finite(record: &IterationRecord) -> bool {
    [record.objective, record.constraint_violation, record.dual_infeasibility, record.barrier, record.step]
        .iter()
        .all(|x| x.is_finite())
}

/// Stores the gait of a trial.
///
/// # Errors
/// A violated constraint if the trial has one already; errors of the database.
pub async fn insert(db: &mut Connection, trial: TrialId, packed: &PackedGait) -> StoreResult<()> {
    sqlx::query(
        "insert into gaits (trial_id, format_version, speed_m_s, stride_length_m, stride_time_s, gait, warm_start, \
         iterations, gait_sha256, created_at) values (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(trial)
    .bind(packed.format_version)
    .bind(packed.speed_m_s)
    .bind(packed.stride_length_m)
    .bind(packed.stride_time_s)
    .bind(&packed.gait[..])
    .bind(&packed.warm_start[..])
    .bind(&packed.iterations[..])
    .bind(&packed.sha256)
    .bind(now())
    .execute(db)
    .await?;
    Ok(())
}

/// Whether the descriptive columns of a gait match it.
///
/// # Errors
/// Errors of the database.
pub async fn is_described(db: &mut Connection, trial: TrialId, gait: &Gait) -> StoreResult<bool> {
    let row = sqlx::query(
        "select format_version = ? and speed_m_s is ? and stride_length_m is ? and stride_time_s is ? \
         from gaits where trial_id = ?",
    )
    .bind(gait.format_version)
    .bind(gait.speed_m_s)
    .bind(gait.stride_length_m)
    .bind(gait.stride_time_s)
    .bind(trial)
    .fetch_one(db)
    .await?;
    Ok(row.try_get(0)?)
}

/// Whether the record has the gait of a trial, or its last iterate. Not for trials of scripts and for pruned
/// trajectories.
///
/// # Errors
/// Errors of the database.
pub async fn exists(db: &mut Connection, trial: TrialId) -> StoreResult<bool> {
    let row = sqlx::query("select exists(select 1 from gaits where trial_id = ?)").bind(trial).fetch_one(db).await?;
    Ok(row.try_get(0)?)
}

/// The trials among these whose gait, or last iterate, is in the record.
///
/// # Errors
/// Errors of the database.
pub async fn existing(db: &mut Connection, of: &[TrialId]) -> StoreResult<HashSet<TrialId>> {
    let rows = sqlx::query("select trial_id from gaits where trial_id in (select value from json_each(?))")
        .bind(json_columns::to_text("trials", of)?)
        .fetch_all(db)
        .await?;
    rows.iter().map(|row| Ok(row.try_get(0)?)).collect()
}

/// The gait of a trial.
///
/// # Errors
/// [`StoreError::Missing`] if the trial has none; errors of the database.
pub async fn get(db: &mut Connection, trial: TrialId) -> StoreResult<Packed<Gait>> {
    let sql = "select gait, gait_sha256 from gaits where trial_id = ?";
    let row = sqlx::query(sql).bind(trial).fetch_optional(db).await?.ok_or_else(|| missing(trial))?;
    Ok(Packed::new(PackedText::new("gait", row.try_get("gait")?, Some(row.try_get("gait_sha256")?))))
}

/// [`get`]; `None` if the trial has none.
///
/// # Errors
/// Errors of the database.
pub async fn find(db: &mut Connection, trial: TrialId) -> StoreResult<Option<Packed<Gait>>> {
    match get(db, trial).await {
        Ok(gait) => Ok(Some(gait)),
        Err(StoreError::Missing { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The warm start of a trial.
///
/// # Errors
/// [`StoreError::Missing`] if the trial has none; errors of the database.
pub async fn warm_start(db: &mut Connection, trial: TrialId) -> StoreResult<Packed<WarmStart>> {
    column(db, trial, "warm start", "select warm_start from gaits where trial_id = ?").await
}

/// The iterations of the solve.
///
/// # Errors
/// [`StoreError::Missing`] if the trial has none; errors of the database.
pub async fn iterations(db: &mut Connection, trial: TrialId) -> StoreResult<Packed<Vec<IterationRecord>>> {
    column(db, trial, "iterations", "select iterations from gaits where trial_id = ?").await
}

/// Deletes the gaits of a study, except those of the `kept` trials, their warm starts, and gaits of lab sessions.
/// Returns their number.
///
/// # Errors
/// Errors of the database.
pub async fn drop_of_study(db: &mut Connection, study: super::StudyId, kept: &[TrialId]) -> StoreResult<u64> {
    let done = sqlx::query(
        "delete from gaits where trial_id in (select id from trials where study_id = ?1) \
         and trial_id not in (select value from json_each(?2)) \
         and trial_id not in (select warm_started_from from trials where warm_started_from is not null \
                              and id in (select value from json_each(?2))) \
         and trial_id not in (select trial_a from lab_sessions union select trial_b from lab_sessions)",
    )
    .bind(study)
    .bind(json_columns::to_text("trials", &kept)?)
    .execute(db)
    .await?;
    Ok(done.rows_affected())
}

async fn column<T: DeserializeOwned>(
    db: &mut Connection,
    trial: TrialId,
    what: &'static str,
    sql: &'static str,
) -> StoreResult<Packed<T>> {
    let row = sqlx::query(sql).bind(trial).fetch_optional(db).await?.ok_or_else(|| missing(trial))?;
    Ok(Packed::new(PackedText::new(what, row.try_get(0)?, None)))
}

fn missing(trial: TrialId) -> StoreError {
    StoreError::Missing { what: "gait for trial", id: trial.to_string() }
}
