//! The atlas that a study makes, as REST serves it.

use gaitwright_service::studies::atlas::{AtlasProgress, StudyAtlas};
use gaitwright_store::TrialId;
use gaitwright_store::certificates::CertificateOnRecord;
use serde::Serialize;
use std::collections::HashMap;
use utoipa::ToSchema;

/// Progress and best gait of an atlas.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Atlas {
    /// Number of actions of the search space.
    actions: u64,
    /// Number of actions with a gait, or with a solve that found none.
    actions_with_result: u64,
    /// Number of actions with a gait.
    actions_with_gait: u64,
    /// Number of different gaits.
    gaits: u32,
    /// Number of solves that these results come from.
    solves: u64,
    /// About how many solves are missing, if each serves as many further actions as the latest ones did.
    solves_left: u64,
    /// The trial with the lowest Gait RMSE. Null before the first gait.
    best_trial_id: Option<TrialId>,
    /// Its Gait RMSE, rad.
    best_gait_rmse_rad: Option<f64>,
    /// The trial with the lowest Gait RMSE among those that passed certification. Null if none has passed yet.
    best_certified_trial_id: Option<TrialId>,
    /// Its Gait RMSE, rad.
    best_certified_gait_rmse_rad: Option<f64>,
}

impl Atlas {
    pub(crate) fn of(atlas: &StudyAtlas, certified: &HashMap<TrialId, CertificateOnRecord>) -> Self {
        let AtlasProgress { actions, with_result, with_gait, gaits, solves, solves_left } = atlas.progress;
        let ranked = atlas.by_gait_rmse();
        let best = ranked.first();
        let best_certified = atlas.best_certified(certified);
        Self {
            actions,
            actions_with_result: with_result,
            actions_with_gait: with_gait,
            gaits,
            solves,
            solves_left,
            best_trial_id: best.map(|result| result.trial.id),
            best_gait_rmse_rad: best.and_then(|result| result.trial.gait_rmse_rad),
            best_certified_trial_id: best_certified.map(|result| result.trial.id),
            best_certified_gait_rmse_rad: best_certified.and_then(|result| result.trial.gait_rmse_rad),
        }
    }
}
