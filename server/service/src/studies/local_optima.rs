//! The local optima that the cold start of a trial reached: candidates for the root gait of another study.

use crate::error::Error;
use gait_optimizer::solve::StartedFrom;
use gait_optimizer::{Gait, SolveReport};
use gaitwright_compute::OnPool;
use gaitwright_store::trials::Trial;
use gaitwright_store::{Connection, Packed, StoreResult, TrialId, gaits, other_local_optima, trials};

/// A local optimum.
#[derive(Debug)]
pub struct FoundLocalOptimum<G = Gait> {
    /// Its number, in the order in which the initial guesses reached them, from 1.
    pub number: u32,
    /// Whether its gait is the result of the trial.
    pub is_result: bool,
    /// Objective.
    pub objective: f64,
    /// Gait RMSE against the reference gait of the study, rad.
    pub gait_rmse_rad: f64,
    /// Its gait.
    pub gait: G,
}

/// The local optima of a trial, by number. None after a warm start and without a gait.
///
/// # Errors
/// Errors of the database.
pub async fn of_trial(db: &mut Connection, id: TrialId) -> Result<Vec<FoundLocalOptimum<Packed<Gait>>>, Error> {
    let trial = trials::get(db, id).await?;
    let (Some((number, report)), Some(gait)) = (result_of_cold_start(&trial), gaits::find(db, id).await?) else {
        return Ok(Vec::new());
    };
    let (objective, gait_rmse_rad) = (report.objective, report.gait_rmse_rad);
    let mut found = vec![FoundLocalOptimum { number, is_result: true, objective, gait_rmse_rad, gait }];
    for stored in other_local_optima::of_trial(db, id).await? {
        let other_local_optima::StoredLocalOptimum { number, objective, gait_rmse_rad, gait, .. } = stored;
        found.push(FoundLocalOptimum { number, is_result: false, objective, gait_rmse_rad, gait });
    }
    found.sort_by_key(|one| one.number);
    Ok(found)
}

/// The number of the local optimum that is the result of a trial.
fn result_of_cold_start(trial: &Trial) -> Option<(u32, &SolveReport)> {
    let report = trial.report.as_ref().filter(|report| report.started_from == StartedFrom::Cold)?;
    let number = report.solver_runs.iter().find(|run| run.chosen)?.local_optimum?;
    Some((u32::try_from(number).ok()?, report))
}

/// Decompresses their gaits.
///
/// # Errors
/// [`gaitwright_store::StoreError::Damaged`] if one cannot be decompressed.
pub fn unpacked(pool: &OnPool, packed: Vec<FoundLocalOptimum<Packed<Gait>>>) -> StoreResult<Vec<FoundLocalOptimum>> {
    let unpack = |one: FoundLocalOptimum<Packed<Gait>>| {
        let FoundLocalOptimum { number, is_result, objective, gait_rmse_rad, gait } = one;
        Ok(FoundLocalOptimum { number, is_result, objective, gait_rmse_rad, gait: gait.unpack(pool)? })
    };
    packed.into_iter().map(unpack).collect()
}
