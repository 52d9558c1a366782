//! Measured activity beside the activations of the model, where the model has the muscle.

use super::{CYCLE_POINTS, CycleActivity};
use crate::gait::Gait;
use crate::muscle::MUSCLES;
use crate::reference::ReferenceGait;
use serde::{Deserialize, Serialize};

/// Channel and muscle that belong together. Rectus femoris has no muscle of its own in the model: it is part of hip
/// flexors and vasti.
const COUNTERPARTS: [(&str, &str); 4] = [("TA_L", "TA_L"), ("BF_L", "HAM_L"), ("GAS_L", "GAS_L"), ("BF_R", "HAM_R")];

/// The activation of the muscle of a channel over the gait cycle, and how near the measured activity is to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelActivity {
    /// Name of the channel.
    pub channel: String,
    /// Name of the muscle.
    pub muscle: String,
    /// Activation at 0, 1, ..., 100 % of the cycle, 0 to 1.
    pub activation: Vec<f64>,
    /// RMS difference of activation and measured activity, which is in shares of the peak of normal walking.
    pub rms_difference: f64,
    /// Correlation over the cycle, which does not depend on scales; none where one of them is constant.
    pub correlation: Option<f64>,
}

/// The activation of the muscle that a channel measures; none without muscles, or where the model lacks it.
pub fn model_activity(gait: &Gait, measured: &CycleActivity) -> Option<ModelActivity> {
    let (_, muscle) = COUNTERPARTS.into_iter().find(|(channel, _)| *channel == measured.channel)?;
    let index = MUSCLES.iter().position(|known| known.name == muscle)?;
    let activation: Vec<f64> = (0..CYCLE_POINTS)
        .map(|point| {
            let share = point as f64 / (CYCLE_POINTS - 1) as f64;
            gait.activations_at(share * gait.stride_time_s).map(|all| all[index])
        })
        .collect::<Option<_>>()?;
    let squares: f64 = activation.iter().zip(&measured.mean).map(|(a, b)| (a - b).powi(2)).sum();
    Some(ModelActivity {
        channel: measured.channel.clone(),
        muscle: muscle.to_owned(),
        rms_difference: (squares / CYCLE_POINTS as f64).sqrt(),
        correlation: ReferenceGait::correlation(&activation, &measured.mean),
        activation,
    })
}
