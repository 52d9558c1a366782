//! The analytic solver with consistent gaits and figures, as the import of an archive requires.

use crate::analytic::Analytic;
use gait_optimizer::body::WalkerModel;
use gait_optimizer::gait::ContactRowName;
use gait_optimizer::walking::{BEZIER_COEFFICIENTS, CYCLE, phase_gradient};
use gait_optimizer::{CancelToken, DomainTrajectory, GaitResults, IterationRecord, SolveOutcome};
use gaitwright_service::workers::{Assignment, Evaluate};

/// The analytic solver with complete gaits, from which the figures of the report are computed.
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
        let model = WalkerModel::new(&gait.subject, &gait.device).map_err(|e| e.to_string())?;
        for (trajectory, domain) in gait.domains.iter_mut().zip(CYCLE) {
            let (rows, outputs) = (domain.contact_rows(), domain.outputs());
            let named = rows.iter().map(|row| ContactRowName { point: row.point, side: row.side, axis: row.axis });
            domain.name().clone_into(&mut trajectory.name);
            move_the_hip(trajectory, phase_gradient(&model, domain.stance));
            // So that trials with different figures have different motions.
            trajectory.u.iter_mut().flatten().for_each(|torque| *torque *= 1.0 + outcome.report.gait_rmse_rad);
            trajectory.contact_rows = named.collect();
            trajectory.contact_forces = vec![vec![100.0; rows.len()]; trajectory.q.len()];
            trajectory.bezier = vec![vec![0.0; BEZIER_COEFFICIENTS]; outputs.len()];
            trajectory.outputs = outputs;
            trajectory.impulse = domain.opens_with_impact().then(|| vec![0.0; rows.len()]);
        }
        gait.speed_m_s = gait.stride_length_m / gait.stride_time_s;
        let figures = GaitResults::of(gait, &assignment.problem.reference).map_err(|e| e.to_string())?;
        let report = &mut outcome.report;
        report.gait_rmse_rad = figures.gait_rmse_rad;
        report.gait_rmse_parts_rad = figures.gait_rmse_parts_rad;
        report.cost_of_transport = figures.cost_of_transport;
        report.speed_m_s = figures.speed_m_s;
        report.stride_length_m = figures.stride_length_m;
        report.durations_s = figures.durations_s;
        report.vhip_m_s = figures.vhip_m_s;
        Ok(outcome)
    }
}

/// Changes the velocities so that the hip moves evenly to its last position within the duration.
fn move_the_hip(trajectory: &mut DomainTrajectory, gradient: [f64; 7]) {
    let along = |row: &[f64; 9]| -> f64 { gradient.iter().zip(&row[2..]).map(|(g, c)| g * c).sum() };
    let square: f64 = gradient.iter().map(|g| g * g).sum();
    let (Some(first), Some(last)) = (trajectory.q.first(), trajectory.q.last()) else { return };
    let velocity = (along(last) - along(first)) / trajectory.duration_s;
    for qd in &mut trajectory.qd {
        let missing = (velocity - along(qd)) / square;
        for (rate, g) in qd[2..].iter_mut().zip(gradient) {
            *rate += missing * g;
        }
    }
}
