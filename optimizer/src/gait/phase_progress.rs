//! Phase variable and hip velocity of a gait at its nodes.

use super::{DomainTrajectory, Gait};
use crate::body::WalkerModel;
use crate::model_error::ModelError;
use crate::quadrature::simpson;
use crate::walking::{CYCLE, phase_gradient};

/// Phase and hip velocity at a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseProgress {
    /// Phase of the domain: 0 at its start, 1 at its end.
    pub phase: f64,
    /// Rate of the linearised hip position, m/s.
    pub hip_velocity_m_s: f64,
}

/// Phase and hip velocity at the nodes of all domains, in order of time.
///
/// # Errors
/// [`ModelError`] if subject or device of the gait is invalid.
pub fn progress(gait: &Gait) -> Result<Vec<PhaseProgress>, ModelError> {
    let model = WalkerModel::new(&gait.subject, &gait.device)?;
    let of_domain = |(domain, trajectory): (_, &DomainTrajectory)| {
        let gradient = phase_gradient(&model, domain);
        let along =
            |coordinates: &[f64; 9]| -> f64 { gradient.iter().zip(&coordinates[2..]).map(|(g, c)| g * c).sum() };
        let (start, width) = (trajectory.phase_start_m, trajectory.phase_end_m - trajectory.phase_start_m);
        let point = |(q, qd): (&[f64; 9], &[f64; 9])| PhaseProgress {
            phase: (along(q) - start) / width,
            hip_velocity_m_s: along(qd),
        };
        trajectory.q.iter().zip(&trajectory.qd).map(point).collect::<Vec<_>>()
    };
    Ok(CYCLE.iter().map(|domain| domain.stance).zip(&gait.domains).flat_map(of_domain).collect())
}

/// How far the hip position at the end of a domain is from the integral of its velocity over the stated duration, m, in
/// the worst domain of a well-formed gait. It is within the tolerance of the constraints for a converged gait: the hip
/// velocity is constant, or, in SS1, integrated by the same Simpson rule.
///
/// # Errors
/// [`ModelError`] if subject or device of the gait is invalid.
pub fn progress_error_m(gait: &Gait) -> Result<f64, ModelError> {
    let all = progress(gait)?;
    let mut later = &all[..];
    let mut worst = 0.0_f64;
    for domain in &gait.domains {
        let (nodes, rest) = later.split_at(domain.q.len());
        later = rest;
        let [first, .., last] = nodes else { continue };
        let travelled = (last.phase - first.phase) * (domain.phase_end_m - domain.phase_start_m);
        let velocities = nodes.iter().enumerate().map(|(k, node)| simpson(k, nodes.len()) * node.hip_velocity_m_s);
        worst = worst.max((travelled - domain.duration_s * velocities.sum::<f64>()).abs());
    }
    Ok(worst)
}
