//! The analytic solver with consistent gaits and figures, as the import of an archive requires.

use crate::analytic::Analytic;
use gait_optimizer::gait::ContactRowName;
use gait_optimizer::metrics::gait_rmse;
use gait_optimizer::walking::{BEZIER_COEFFICIENTS, CYCLE};
use gait_optimizer::{CancelToken, IterationRecord, SolveOutcome};
use gaitwright_service::workers::{Assignment, Evaluate};

/// The analytic solver with complete gaits, whose Gait RMSE is computed from the gait.
#[derive(Debug, Default)]
pub struct Consistent(pub Analytic);

impl Evaluate for Consistent {
    fn evaluate(
        &self,
        assignment: &Assignment,
        observer: &mut dyn FnMut(&IterationRecord),
        cancel: &CancelToken,
    ) -> Result<SolveOutcome, String> {
        let mut outcome = self.0.evaluate(assignment, observer, cancel)?;
        let gait = &mut outcome.gait;
        for (trajectory, domain) in gait.domains.iter_mut().zip(CYCLE) {
            let (rows, outputs) = (domain.contact_rows(), domain.outputs());
            let named = rows.iter().map(|row| ContactRowName { point: row.point, side: row.side, axis: row.axis });
            domain.name().clone_into(&mut trajectory.name);
            trajectory.contact_rows = named.collect();
            trajectory.contact_forces = vec![vec![100.0; rows.len()]; trajectory.q.len()];
            trajectory.bezier = vec![vec![0.0; BEZIER_COEFFICIENTS]; outputs.len()];
            trajectory.outputs = outputs;
            trajectory.impulse = domain.opens_with_impact().then(|| vec![0.0; rows.len()]);
        }
        gait.speed_m_s = gait.stride_length_m / gait.stride_time_s;
        let rmse = gait_rmse(gait, &assignment.problem.reference);
        outcome.report.gait_rmse_rad = rmse.total;
        outcome.report.gait_rmse_parts_rad = rmse.parts;
        Ok(outcome)
    }
}
