//! Gait RMSE: the distance of the joint angles of a gait from those of a reference gait.

use crate::gait::Gait;
use crate::reference::ReferenceGait;

/// Number of equidistant times of the stride at which gait and reference are compared.
pub const RMSE_SAMPLES: usize = 200;

/// Gait RMSE and its parts, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaitRmse {
    /// Sum of the parts.
    pub total: f64,
    /// RMS differences of torso, hip_L, knee_L, ankle_L and hip_R.
    pub parts: [f64; 5],
}

/// Gait RMSE: `sum_i sqrt(mean((q_i - ref_i)^2))` over the five human coordinates, at equidistant times of the stride.
/// Gait and reference are interpolated linearly.
pub fn gait_rmse(gait: &Gait, reference: &ReferenceGait) -> GaitRmse {
    gait_rmse_with_shift(gait, reference, 0.0)
}

/// Gait RMSE against the reference gait delayed by a fraction of the stride.
pub(crate) fn gait_rmse_with_shift(gait: &Gait, reference: &ReferenceGait, shift: f64) -> GaitRmse {
    let mut squares = [0.0; 5];
    for sample in 0..RMSE_SAMPLES {
        let fraction = sample as f64 / RMSE_SAMPLES as f64;
        let angles = gait.coordinates_at(fraction * gait.stride_time_s);
        let wanted = reference.at(fraction - shift);
        for i in 0..5 {
            squares[i] += (angles[2 + i] - wanted[i]).powi(2);
        }
    }
    let parts = squares.map(|s| (s / RMSE_SAMPLES as f64).sqrt());
    GaitRmse { total: parts.iter().sum(), parts }
}
