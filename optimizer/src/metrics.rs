//! Metrics of a gait: Gait RMSE against a reference, cost of transport, and alternations of the muscle activations.

use crate::body::{GRAVITY, JOINTS};
use crate::gait::Gait;
use crate::gait::motion::instant;
use crate::muscle::MUSCLE_COUNT;
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

/// Parts of the time between two nodes for the integral of the joint powers, whose magnitudes have kinks.
const POWER_SAMPLES: usize = 32;

/// Mechanical cost of transport `sum_i integral |P_i| dt / (m g D)` over the six joint powers `P_i = u_i qd_(3+i)` of the
/// continuous motion of a well-formed gait, by the midpoint rule; dimensionless. The objective smooths |P|.
pub fn unsmoothed_cost_of_transport(gait: &Gait, total_mass_kg: f64) -> f64 {
    let mut effort_j = 0.0;
    for domain in &gait.domains {
        let samples = (domain.q.len() - 1) * POWER_SAMPLES;
        let mut sum_w = 0.0;
        for sample in 0..samples {
            let at = instant(domain, (sample as f64 + 0.5) / samples as f64);
            sum_w += (0..JOINTS).map(|i| (at.u[i] * at.qd[3 + i]).abs()).sum::<f64>();
        }
        effort_j += domain.duration_s * sum_w / samples as f64;
    }
    effort_j / (total_mass_kg * GRAVITY * gait.stride_length_m)
}

/// Smallest step of an activation that counts in an alternation.
const ALTERNATING_STEP: f64 = 0.005;

/// Number of alternations of a curve: three consecutive steps of alternating sign, each of more than 0.005.
pub fn alternations(curve: &[f64]) -> usize {
    let steps: Vec<f64> = curve.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let alternate =
        |s: &&[f64]| s[0] * s[1] < 0.0 && s[1] * s[2] < 0.0 && s.iter().all(|step| step.abs() > ALTERNATING_STEP);
    steps.windows(3).filter(alternate).count()
}

/// Number of alternations of the muscle activations from node to node, over all muscles and domains.
pub fn activation_alternations(gait: &Gait) -> usize {
    let muscles = gait.domains.iter().filter_map(|domain| domain.muscles.as_ref());
    muscles
        .flat_map(|trajectory| {
            (0..MUSCLE_COUNT).map(|m| alternations(&trajectory.activation.iter().map(|all| all[m]).collect::<Vec<_>>()))
        })
        .sum()
}
