//! The mechanical cost of transport of a gait, from absolute joint powers.

use crate::body::{GRAVITY, JOINTS};
use crate::gait::Gait;
use crate::gait::between_nodes::instant;

/// Parts of the time between two nodes for the integral of the joint powers, whose magnitudes have kinks.
const POWER_SAMPLES: usize = 32;

/// Mechanical cost of transport `sum_i integral |P_i| dt / (m g D)` over the six joint powers `P_i = u_i qd_(3+i)` of the
/// continuous motion of a well-formed gait, by the midpoint rule; dimensionless. The objective has a smoothed |P|, which is smaller.
pub fn cost_of_transport(gait: &Gait, total_mass_kg: f64) -> f64 {
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
