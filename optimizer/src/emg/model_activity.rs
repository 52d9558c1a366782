//! Comparison of measured muscle activity with the activations of the model.

use super::{CYCLE_POINTS, CycleActivity};
use crate::gait::Gait;
use crate::muscle::MUSCLES;
use crate::statistics::correlation;
use serde::{Deserialize, Serialize};

/// Channels and the corresponding muscles. The model has no rectus femoris; it is part of hip flexors and vasti.
const COUNTERPARTS: [(&str, &str); 4] = [("TA_L", "TA_L"), ("BF_L", "HAM_L"), ("GAS_L", "GAS_L"), ("BF_R", "HAM_R")];

/// Activation of the muscle of a channel over the gait cycle, and its agreement with the measured activity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelActivity {
    /// Name of the channel.
    pub channel: String,
    /// Name of the muscle.
    pub muscle: String,
    /// Activation at 0, 1, ..., 100 % of the cycle, 0 to 1.
    pub activation: Vec<f64>,
    /// RMS difference of activation and measured activity relative to the peak of normal walking.
    pub rms_difference: f64,
    /// Correlation over the cycle; `None` if one of the curves is constant.
    pub correlation: Option<f64>,
}

/// Activation of the muscle that a channel measures. `None` without muscles, or if the model does not have the muscle.
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
        correlation: correlation(&activation, &measured.mean),
        activation,
    })
}
