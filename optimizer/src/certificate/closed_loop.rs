//! The closed loop: consecutive strides, and contacts, friction and torques over the periodic stride.

use super::checked_quantity::{Check, CheckLocation, WorstValues};
use super::feedback_linearization::{State, split};
use super::hybrid_walker::{CompletedDomain, Fall, HybridWalker};
use super::limit_excess::{AllowedRanges, depth_below_ground};
use super::limits::{
    CLOSED_LOOP_ANGLE as ANGLE, CLOSED_LOOP_DEPTH as DEPTH, CLOSED_LOOP_FRICTION as FRICTION,
    CLOSED_LOOP_IMPULSE as IMPULSE, CLOSED_LOOP_NORMAL_FORCE as NORMAL_FORCE, CLOSED_LOOP_ORBIT_ANGLE as ORBIT_ANGLE,
    CLOSED_LOOP_ORBIT_RATE as ORBIT_RATE, CLOSED_LOOP_SPEED as SPEED, CLOSED_LOOP_TORQUE as TORQUE,
};
use crate::body::PointState;
use crate::gait::Gait;
use crate::gait::between_nodes::instant;
use crate::walking::CYCLE;

/// Number of simulated strides.
pub const STRIDES: usize = 20;

/// Simulates [`STRIDES`] strides from the first state of the gait, and measures the distance to it after each stride.
pub(super) fn orbit(walker: &HybridWalker<'_>, start: &State) -> Result<Vec<Check>, Fall> {
    let mut worst = WorstValues::default();
    let mut x = *start;
    for stride in 1..=STRIDES {
        x = walker.after_stride(&x)?;
        let distance = x - start;
        let name = format!("stride {stride}");
        let place = CheckLocation { domain: &name, time_s: None };
        worst.add(ORBIT_ANGLE, distance.rows(2, 7).amax(), place);
        worst.add(ORBIT_RATE, distance.rows(9, 9).amax(), place);
    }
    Ok(worst.into_checks(", closed loop"))
}

/// Measures the periodic stride at every step of the integration.
pub(super) fn periodic_stride(walker: &HybridWalker<'_>, gait: &Gait, periodic: &State) -> Result<Vec<Check>, Fall> {
    let mut samples: Vec<(usize, f64, State)> = Vec::new();
    let passages = walker.stride(periodic, &mut |d, time, x| samples.push((d, time, *x)))?;
    let starts: Vec<f64> = passages
        .iter()
        .scan(0.0, |elapsed, passage: &CompletedDomain| {
            let start = *elapsed;
            *elapsed += passage.duration;
            Some(start)
        })
        .collect();
    let limits = AllowedRanges::new(gait);
    let mut worst = WorstValues::default();
    for (d, time, x) in &samples {
        let control = &walker.controls[*d];
        let place = CheckLocation { domain: control.domain.name(), time_s: Some(starts[*d] + time) };
        let (q, qd) = split(x);
        let phase = control.constraints.phase(&q, &qd, &[0.0; 9]);
        let plan = instant(&gait.domains[*d], phase.s).u;
        let qdd = control.acceleration(x).unwrap_or([f64::NAN; 9]);
        let rows = control.domain.contact_rows();
        // Without a solution, NaN marks every quantity as undetermined.
        let (pulling, sliding, torque) = match control.effort(x, &qdd, &plan, &limits) {
            Some(effort) => (
                limits.normal_force(&rows, &effort.forces),
                limits.friction(&rows, &effort.forces),
                limits.torque(&effort.u),
            ),
            None => (f64::NAN, f64::NAN, f64::NAN),
        };
        worst.add(NORMAL_FORCE, pulling, place);
        worst.add(FRICTION, sliding, place);
        worst.add(TORQUE, torque, place);
        let excess = limits.motion(&q, &qd, &qdd);
        worst.add(ANGLE, excess.angle, place);
        worst.add(SPEED, excess.speed, place);
        let state = PointState::new(&q, &qd, &[0.0; 9]);
        worst.add(DEPTH, depth_below_ground(walker.model, control.domain, &state), place);
    }
    for (d, passage) in passages.iter().enumerate() {
        let opens = CYCLE[(d + 1) % CYCLE.len()];
        if let (Some(impact), Some(row)) = (&passage.impact, opens.landing_row()) {
            let place = CheckLocation { domain: opens.name(), time_s: Some(starts[d] + passage.duration) };
            worst.add(IMPULSE, -impact.impulse[row], place);
        }
    }
    Ok(worst.into_checks(", closed loop"))
}
