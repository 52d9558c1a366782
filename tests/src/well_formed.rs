//! An analytic solver with complete gaits, from which controller files can be made.

use crate::analytic::Analytic;
use gait_optimizer::gait::ContactRowName;
use gait_optimizer::walking::{BEZIER_COEFFICIENTS, CYCLE};
use gait_optimizer::{CancelToken, Gait, IterationRecord, SolveOutcome};
use gaitwright_service::workers::{Assignment, Evaluate};
use std::sync::atomic::{AtomicU32, Ordering};

/// The analytic solver with well-formed gaits, each with curves of its own. The figures of equal gaits differ a little
/// between solves, as those of real solves with different starts do.
#[derive(Debug, Default)]
pub struct WellFormed {
    analytic: Analytic,
    solves: AtomicU32,
}

/// Relative difference of a figure between a solve and the next one.
const DRIFT: f64 = 2e-6;

impl Evaluate for WellFormed {
    fn evaluate(
        &self,
        assignment: &Assignment,
        observer: &mut dyn FnMut(&IterationRecord),
        cancel: &CancelToken,
    ) -> Result<SolveOutcome, String> {
        let mut outcome = self.analytic.evaluate(assignment, observer, cancel)?;
        let solves = self.solves.fetch_add(1, Ordering::Relaxed);
        outcome.report.cost_of_transport *= 1.0 + DRIFT * f64::from(solves);
        complete(&mut outcome.gait, assignment.number);
        outcome.gait.validate().map_err(|e| e.to_string())?;
        Ok(outcome)
    }
}

/// Gives each domain valid contacts, curves and times. Every curve contains the number, so gaits differ.
fn complete(gait: &mut Gait, number: u32) {
    for (trajectory, domain) in gait.domains.iter_mut().zip(CYCLE) {
        let points = trajectory.q.len();
        let rows = domain.contact_rows();
        trajectory.contact_rows =
            rows.iter().map(|row| ContactRowName { point: row.point, side: row.side, axis: row.axis }).collect();
        trajectory.contact_forces = vec![vec![100.0; rows.len()]; points];
        trajectory.outputs = domain.outputs();
        trajectory.bezier = vec![vec![f64::from(number) * 1e-3; BEZIER_COEFFICIENTS]; trajectory.outputs.len()];
        trajectory.impulse = domain.opens_with_impact().then(|| vec![0.0; rows.len()]);
    }
    gait.stride_time_s = gait.domains.iter().map(|domain| domain.duration_s).sum();
    gait.speed_m_s = gait.stride_length_m / gait.stride_time_s;
}
