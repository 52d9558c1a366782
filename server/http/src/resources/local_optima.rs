//! Local optima on the wire.

use gaitwright_service::studies::local_optima::FoundLocalOptimum;
use serde::Serialize;
use utoipa::ToSchema;

/// A local optimum that the cold start of a trial reached.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct LocalOptimum {
    /// Its number, from 1, in the order in which the initial guesses reached them.
    number: u32,
    /// Whether its gait is the result of the trial.
    is_result: bool,
    /// Objective.
    objective: f64,
    /// Gait RMSE against the reference gait of the study, rad.
    gait_rmse_rad: f64,
    /// Walking speed, m/s.
    speed_m_s: f64,
    /// Stride length, m.
    stride_length_m: f64,
}

impl From<FoundLocalOptimum> for LocalOptimum {
    fn from(found: FoundLocalOptimum) -> Self {
        let FoundLocalOptimum { number, is_result, objective, gait_rmse_rad, gait } = found;
        let (speed_m_s, stride_length_m) = (gait.speed_m_s, gait.stride_length_m);
        Self { number, is_result, objective, gait_rmse_rad, speed_m_s, stride_length_m }
    }
}
