//! How a gait progresses: the phase variable of its domains, and the hip velocity that the virtual constraints hold.

use super::{CYCLE, phase_gradient};
use crate::body::WalkerModel;
use crate::gait::Gait;
use crate::subject::ModelError;

/// Progress at a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Phase of the domain: 0 at its planned start, 1 at its planned end.
    pub phase: f64,
    /// Velocity of the linearised position of the hip over the stance toe, m/s.
    pub hip_velocity_m_s: f64,
}

/// Progress at the nodes of all domains, in time.
///
/// # Errors
/// [`ModelError`] when the gait's subject or device is invalid.
pub fn progress(gait: &Gait) -> Result<Vec<Progress>, ModelError> {
    let model = WalkerModel::new(&gait.subject, &gait.device)?;
    let of_domain = |(domain, trajectory): (_, &crate::gait::DomainTrajectory)| {
        let gradient = phase_gradient(&model, domain);
        let along =
            |coordinates: &[f64; 9]| -> f64 { gradient.iter().zip(&coordinates[2..]).map(|(g, c)| g * c).sum() };
        let (start, width) = (trajectory.phase_start_m, trajectory.phase_end_m - trajectory.phase_start_m);
        let point = |(q, qd): (&[f64; 9], &[f64; 9])| Progress {
            phase: (along(q) - start) / width,
            hip_velocity_m_s: along(qd),
        };
        trajectory.q.iter().zip(&trajectory.qd).map(point).collect::<Vec<_>>()
    };
    Ok(CYCLE.iter().map(|domain| domain.stance).zip(&gait.domains).flat_map(of_domain).collect())
}
