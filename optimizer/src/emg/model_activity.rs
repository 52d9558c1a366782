//! Comparison of measured muscle activity with the activations of the model.

use super::{CYCLE_POINTS, CycleActivity, CycleStart};
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
    /// Activation at 0, 1, ..., 100 % of the cycle of the channel, 0 to 1.
    pub activation: Vec<f64>,
    /// RMS difference of activation and measured activity relative to the peak of normal walking.
    pub rms_difference: f64,
    /// Correlation over the cycle; `None` if one of the curves is constant.
    pub correlation: Option<f64>,
}

/// Rounding error of a sum of durations, s.
const ROUNDING_S: f64 = 1e-9;
/// The domain that begins with the left heel strike.
const LEFT_HEEL_STRIKE: &str = "DS2_L";

/// Activation of the muscle that a channel measures, over the cycle from the heel strike at which that of the channel
/// begins. `None` without muscles, or if the model does not have the muscle.
pub fn model_activity(gait: &Gait, measured: &CycleActivity) -> Option<ModelActivity> {
    let (_, muscle) = COUNTERPARTS.into_iter().find(|(channel, _)| *channel == measured.channel)?;
    let index = MUSCLES.iter().position(|known| known.name == muscle)?;
    let stride_s = gait.stride_time_s;
    // Activations may jump at an impact: what follows it begins the cycle, and what precedes it ends the cycle.
    let (begin_s, within_s): (f64, f64) = match measured.begins_at {
        CycleStart::RightHeelStrike => (0.0, 0.0),
        CycleStart::LeftHeelStrike | CycleStart::AssumedLeftHeelStrike => {
            let before = gait.domains.iter().take_while(|domain| domain.name != LEFT_HEEL_STRIKE);
            (before.map(|domain| domain.duration_s).sum(), ROUNDING_S)
        }
    };
    let activation: Vec<f64> = (0..CYCLE_POINTS)
        .map(|point| {
            let share = point as f64 / (CYCLE_POINTS - 1) as f64;
            let time_s = begin_s + (share * stride_s).max(within_s).min(stride_s - within_s);
            // The stride is periodic: its start follows its end.
            let time_s = if time_s > stride_s { time_s - stride_s } else { time_s };
            gait.activations_at(time_s).map(|all| all[index])
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
