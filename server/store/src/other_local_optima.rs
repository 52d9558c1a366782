//! Stored gaits of the other local optima that cold starts reached.

use super::{Connection, Packed, PackedText, StoreError, StoreResult, StudyId, TrialId, json_columns};
use gait_optimizer::{Gait, OtherLocalOptimum, WarmStart};
use gaitwright_compute::OnPool;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// A local optimum, ready to be written.
#[derive(Debug)]
pub struct PackedLocalOptimum {
    number: usize,
    objective: f64,
    gait_rmse_rad: f64,
    gait: Vec<u8>,
    warm_start: Vec<u8>,
    gait_sha256: String,
}

impl PackedLocalOptimum {
    /// Serialises and compresses a local optimum.
    ///
    /// # Errors
    /// If serialisation fails.
    pub fn new(pool: &OnPool, found: &OtherLocalOptimum) -> StoreResult<Self> {
        let gait = json_columns::to_text("gait", &found.gait)?;
        let warm_start = json_columns::to_text("warm start", &found.warm_start)?;
        Ok(Self {
            number: found.local_optimum,
            objective: found.objective,
            gait_rmse_rad: found.gait_rmse_rad,
            gait: json_columns::compress(pool, "gait", gait.as_bytes())?,
            warm_start: json_columns::compress(pool, "warm start", warm_start.as_bytes())?,
            gait_sha256: json_columns::sha256(gait.as_bytes()),
        })
    }
}

/// A stored local optimum.
#[derive(Debug, Clone)]
pub struct StoredLocalOptimum {
    /// Its number.
    pub number: u32,
    /// Objective.
    pub objective: f64,
    /// Gait RMSE against the reference gait of the study, rad.
    pub gait_rmse_rad: f64,
    /// Its gait.
    pub gait: Packed<Gait>,
    /// Warm start in it.
    pub warm_start: Packed<WarmStart>,
}

impl StoredLocalOptimum {
    /// Decompresses gait and warm start.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] if they cannot be decompressed.
    pub fn unpack(self, pool: &OnPool) -> StoreResult<OtherLocalOptimum> {
        let Self { number, objective, gait_rmse_rad, gait, warm_start } = self;
        let (gait, warm_start) = (gait.unpack(pool)?, warm_start.unpack(pool)?);
        Ok(OtherLocalOptimum { local_optimum: number as usize, objective, gait_rmse_rad, gait, warm_start })
    }
}

/// Stores a local optimum that the solve of a trial reached.
///
/// # Errors
/// A violated constraint if the trial has its number already; errors of the database.
pub async fn insert(db: &mut Connection, trial: TrialId, packed: &PackedLocalOptimum) -> StoreResult<()> {
    sqlx::query(
        "insert into other_local_optima (trial_id, number, objective, gait_rmse_rad, gait, warm_start, gait_sha256) \
         values (?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(trial)
    .bind(i64::try_from(packed.number).unwrap_or(i64::MAX))
    .bind(packed.objective)
    .bind(packed.gait_rmse_rad)
    .bind(&packed.gait[..])
    .bind(&packed.warm_start[..])
    .bind(&packed.gait_sha256)
    .execute(db)
    .await?;
    Ok(())
}

/// The other local optima of a trial, by number.
///
/// # Errors
/// Errors of the database.
pub async fn of_trial(db: &mut Connection, trial: TrialId) -> StoreResult<Vec<StoredLocalOptimum>> {
    let sql = "select * from other_local_optima where trial_id = ? order by number";
    sqlx::query(sql).bind(trial).fetch_all(db).await?.iter().map(stored).collect()
}

/// One of them.
///
/// # Errors
/// [`StoreError::Missing`] if the trial has none with this number; errors of the database.
pub async fn get(db: &mut Connection, trial: TrialId, number: u32) -> StoreResult<StoredLocalOptimum> {
    let sql = "select * from other_local_optima where trial_id = ? and number = ?";
    let row = sqlx::query(sql).bind(trial).bind(number).fetch_optional(db).await?;
    let missing = || StoreError::Missing { what: "local optimum", id: format!("{number} of trial {trial}") };
    stored(&row.ok_or_else(missing)?)
}

/// Deletes those of a study whose trials have no gait any more.
///
/// # Errors
/// Errors of the database.
pub async fn drop_without_gait(db: &mut Connection, study: StudyId) -> StoreResult<()> {
    sqlx::query(
        "delete from other_local_optima where trial_id in (select id from trials where study_id = ?) \
         and trial_id not in (select trial_id from gaits)",
    )
    .bind(study)
    .execute(db)
    .await?;
    Ok(())
}

fn stored(row: &SqliteRow) -> StoreResult<StoredLocalOptimum> {
    Ok(StoredLocalOptimum {
        number: row.try_get("number")?,
        objective: row.try_get("objective")?,
        gait_rmse_rad: row.try_get("gait_rmse_rad")?,
        gait: Packed::new(PackedText::new("gait", row.try_get("gait")?, Some(row.try_get("gait_sha256")?))),
        warm_start: Packed::new(PackedText::new("warm start", row.try_get("warm_start")?, None)),
    })
}
