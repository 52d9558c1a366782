//! The largest push from which the closed loop recovers.
//!
//! A push changes the forward velocity of the hip at the start of SS2_R, the first instant of single support: an
//! impulse at the hip, with the contact impulses that keep the foot in place. The walker recovers if every domain
//! reaches its guard, the ground never pulls on the foot in single support, and the motion is periodic again after some
//! strides. The torques are those of the ideal controller without limits.

use super::feedback_linearization::{State, join, split};
use super::hybrid_walker::{COARSE, Fall, HybridWalker};
use crate::body::{InverseDynamics, PointState};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Domain of the push: SS2_R.
const PUSHED_DOMAIN: usize = 2;
/// Largest push in the search, m/s.
pub const MAX_PUSH_M_S: f64 = 1.0;
/// Resolution of the search, m/s.
const RESOLUTION_M_S: f64 = 0.01;
/// Number of strides within which the walker must recover.
pub const RECOVERY_STRIDES: usize = 10;
/// Largest distance from the periodic motion after a recovery, rad and rad/s.
const RECOVERED: f64 = 1e-3;

/// Largest changes of the forward hip velocity from which the walker recovers, m/s; at most [`MAX_PUSH_M_S`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pushes {
    /// Forwards.
    pub forwards_m_s: f64,
    /// Backwards.
    pub backwards_m_s: f64,
}

/// The state after a push of `change` m/s that keeps the contacts of the domain.
fn pushed(walker: &HybridWalker<'_>, x: &State, change: f64) -> Option<State> {
    let (q, qd) = split(x);
    let control = &walker.controls[PUSHED_DOMAIN];
    let state = PointState::new(&q, &qd, &[0.0; 9]);
    let mass = InverseDynamics::new(walker.model).mass_matrix(&q);
    let order = 9 + control.contacts.len();
    let mut matrix = DMatrix::<f64>::zeros(order, order);
    let mut rhs = DVector::<f64>::zeros(order);
    for i in 0..9 {
        for j in 0..9 {
            matrix[(i, j)] = mass[i][j];
        }
    }
    for (c, contact) in control.contacts.iter().enumerate() {
        for (i, gradient) in contact.gradient(&state).into_iter().enumerate() {
            matrix[(i, 9 + c)] = -gradient;
            matrix[(9 + c, i)] = gradient;
        }
    }
    rhs[0] = 1.0;
    let response = matrix.lu().solve(&rhs)?;
    let scale = change / response[0];
    let velocity = std::array::from_fn(|i| qd[i] + scale * response[i]);
    Some(join(&q, &velocity))
}

/// Whether the walker recovers from a push.
fn recovers(walker: &HybridWalker<'_>, periodic: &State, at_push: &State, change: f64) -> Result<bool, Fall> {
    let Some(mut x) = pushed(walker, at_push, change) else { return Ok(false) };
    let mut grounded = true;
    let mut watch = |d: usize, _: f64, x: &State| grounded &= walker.controls[d].stays_on_the_ground(x);
    for d in PUSHED_DOMAIN..walker.controls.len() {
        x = walker.passage(d, &x, &mut watch)?.after;
    }
    for _ in 0..RECOVERY_STRIDES {
        if (x - periodic).rows(1, 17).amax() < RECOVERED {
            return Ok(grounded);
        }
        x = walker.stride(&x, &mut watch)?.last().map_or(x, |passage| passage.after);
    }
    Ok(false)
}

/// The largest pushes in both directions, by bisection.
pub(super) fn pushes(walker: &HybridWalker<'_>, periodic: &State) -> Result<Pushes, Fall> {
    let walker = walker.with_tolerance(COARSE);
    let mut at_push = *periodic;
    for d in 0..PUSHED_DOMAIN {
        at_push = walker.passage(d, &at_push, &mut |_, _, _| {})?.after;
    }
    // A fall means that the walker does not recover.
    let survives = |change: f64| recovers(&walker, periodic, &at_push, change).unwrap_or(false);
    let largest = |direction: f64| {
        let (mut good, mut bad) = (0.0, MAX_PUSH_M_S);
        if survives(direction * bad) {
            return bad;
        }
        while bad - good > RESOLUTION_M_S {
            let middle = 0.5 * (good + bad);
            if survives(direction * middle) {
                good = middle;
            } else {
                bad = middle;
            }
        }
        good
    };
    Ok(Pushes { forwards_m_s: largest(1.0), backwards_m_s: largest(-1.0) })
}
