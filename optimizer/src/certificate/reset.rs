//! The reset between domains, with its derivative: a plastic impact before DS2 and DS3, otherwise the identity.

use super::contact_kinematics::{Contact, force_by_angle};
use super::feedback_linearization::{State, StateMatrix, join, split};
use crate::body::{InverseDynamics, PointState, WalkerModel};
use crate::walking::{Domain, Impact, impact};
use nalgebra::DMatrix;

/// The state after the reset, and the impulses of an impact. `None` if the contact rows are linearly dependent.
pub(super) fn reset(model: &WalkerModel, opens: Domain, x: &State) -> Option<(State, Option<Impact>)> {
    if !opens.opens_with_impact() {
        return Some((*x, None));
    }
    let (q, qd) = split(x);
    let impact = impact(model, opens, &q, &qd)?;
    Some((join(&q, &impact.velocity_after), Some(impact)))
}

/// d(state after)/d(state before), by differentiation of the impact equations `M (v+ - v-) = J^T L`, `J v+ = 0`.
pub(super) fn reset_by_state(model: &WalkerModel, opens: Domain, x: &State) -> Option<StateMatrix> {
    let (_, Some(impact)) = reset(model, opens, x)? else { return Some(StateMatrix::identity()) };
    let (q, before) = split(x);
    let after = impact.velocity_after;
    let contacts = Contact::of_domain(model, opens);
    let dynamics = InverseDynamics::without_gravity(model);
    // The change of momentum is the inverse dynamics of the velocity jump at rest.
    let jump: [f64; 9] = std::array::from_fn(|i| after[i] - before[i]);
    let momentum = dynamics.jacobian(&PointState::new(&q, &[0.0; 9], &jump));
    let moving = PointState::new(&q, &after, &[0.0; 9]);
    let by_impulse = force_by_angle(&contacts, &impact.impulse, &moving);
    let order = 9 + contacts.len();
    let mut matrix = DMatrix::<f64>::zeros(order, order);
    let mut rhs = DMatrix::<f64>::zeros(order, 18);
    for i in 0..9 {
        for j in 0..9 {
            matrix[(i, j)] = momentum.mass[i][j];
            rhs[(i, 9 + j)] = momentum.mass[i][j];
        }
        for k in 0..7 {
            let moved_impulse = if i < 2 { 0.0 } else { by_impulse[i - 2][k] };
            rhs[(i, 2 + k)] = moved_impulse - momentum.angle[i][k];
        }
    }
    for (c, contact) in contacts.iter().enumerate() {
        let gradient = contact.gradient(&moving);
        for i in 0..9 {
            matrix[(i, 9 + c)] = -gradient[i];
            matrix[(9 + c, i)] = gradient[i];
        }
        for (k, value) in contact.velocity_by_angle(&moving).into_iter().enumerate() {
            rhs[(9 + c, 2 + k)] = -value;
        }
    }
    let solution = matrix.lu().solve(&rhs)?;
    let mut result = StateMatrix::zeros();
    for i in 0..9 {
        result[(i, i)] = 1.0;
        for j in 0..18 {
            result[(9 + i, j)] = solution[(i, j)];
        }
    }
    Some(result)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::walking::{CYCLE, kinetic_energy};
    use crate::{Device, Subject};

    fn state() -> State {
        let q = [0.1, 0.9, 0.08, 0.35, 0.2, 0.05, -0.2, 0.15, 0.1];
        let qd = [1.2, -0.1, 0.2, -1.3, 0.8, -0.4, 1.1, -0.9, 0.6];
        join(&q, &qd)
    }

    #[test]
    fn derivative_matches_differences_of_the_impact() {
        let model = WalkerModel::new(&Subject::builtin(1).unwrap(), &Device::ampro3().unwrap()).unwrap();
        for domain in CYCLE.into_iter().filter(|d| d.opens_with_impact()) {
            let exact = reset_by_state(&model, domain, &state()).unwrap();
            for column in 0..18 {
                let moved = |change: f64| {
                    let mut x = state();
                    x[column] += change;
                    reset(&model, domain, &x).unwrap().0
                };
                let difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                assert!((difference - exact.column(column)).amax() < 1e-6 * (1.0 + exact.column(column).amax()));
            }
        }
    }

    #[test]
    fn impact_stops_the_contacts_and_dissipates_energy() {
        let model = WalkerModel::new(&Subject::builtin(2).unwrap(), &Device::ampro3().unwrap()).unwrap();
        let (q, before) = split(&state());
        for domain in CYCLE.into_iter().filter(|d| d.opens_with_impact()) {
            let (_, after) = split(&reset(&model, domain, &state()).unwrap().0);
            let moving = PointState::new(&q, &after, &[0.0; 9]);
            for contact in Contact::of_domain(&model, domain) {
                assert!(contact.velocity(&moving).abs() < 1e-12);
            }
            assert!(kinetic_energy(&model, &q, &after) < kinetic_energy(&model, &q, &before));
        }
    }
}
