//! The objective from its definition.

use crate::rows::Problem;
use crate::variables::GaitVariables;
use crate::walker::GRAVITY;
use crate::{Scalar, constant};

/// Weights of the regularisation and smoothing of the power.
pub(crate) struct Weights {
    pub(crate) cost_of_transport: f64,
    pub(crate) tracking: f64,
    pub(crate) power_smoothing: f64,
    pub(crate) torque: f64,
    pub(crate) acceleration: f64,
    pub(crate) force: f64,
    pub(crate) activation: f64,
    pub(crate) fibre_velocity: f64,
    pub(crate) activation_bend: f64,
}

/// Composite Simpson weight of point k over N intervals, as a sum over the intervals it belongs to.
fn simpson(k: usize, intervals: usize) -> f64 {
    let mut weight = 0.0;
    for interval in 0..intervals {
        for (i, share) in [1.0, 4.0, 1.0].into_iter().enumerate() {
            if 2 * interval + i == k {
                weight += share / (6.0 * intervals as f64);
            }
        }
    }
    weight
}

/// Cost of transport, tracking and regularisation with their weights; `reference[d][k]` are the seven tracked angles.
pub(crate) fn value<D: Scalar>(
    problem: &Problem,
    weights: &Weights,
    reference: &[Vec<[f64; 7]>],
    gait: &GaitVariables<D>,
) -> D {
    let zero = constant::<D>(0.0);
    let (mut energy, mut regularisation, mut tracking) = (zero, zero, zero);
    for (d, (domain, variables)) in problem.domains.iter().zip(&gait.domains).enumerate() {
        for (k, point) in variables.points.iter().enumerate() {
            let weight = variables.duration * simpson(k, domain.intervals);
            let square = |values: &[D], scale: f64| {
                let mut sum = zero;
                for value in values {
                    let scaled = *value / scale;
                    sum += scaled * scaled;
                }
                sum
            };
            for i in 0..6 {
                let power = point.u[i] * point.qd[3 + i];
                let eps = weights.power_smoothing;
                energy += weight * ((power * power + eps * eps).sqrt() - eps);
            }
            let mut squares = square(&point.u, 100.0) * weights.torque
                + square(&point.qdd, 30.0) * weights.acceleration
                + square(&point.force, 500.0) * weights.force;
            if let Some([_, velocity, activation]) = &point.fibres {
                squares += square(activation, 1.0) * weights.activation;
                for (muscle, velocity) in problem.muscles.iter().zip(velocity) {
                    squares += square(&[*velocity], muscle.speed) * weights.fibre_velocity;
                }
            }
            regularisation += weight * squares;
            for i in 0..7 {
                let error = point.q[2 + i] - reference[d][k][i];
                tracking += error * error / domain.points() as f64;
            }
        }
        for neighbours in variables.points.windows(3) {
            let [Some([.., first]), Some([.., middle]), Some([.., last])] = [0, 1, 2].map(|i| neighbours[i].fibres)
            else {
                break;
            };
            for m in 0..10 {
                let bend = first[m] - middle[m] * 2.0 + last[m];
                regularisation +=
                    bend * bend * variables.duration * (weights.activation_bend / domain.intervals as f64);
            }
        }
    }
    let transport = energy / (gait.stride * (problem.walker.total_mass() * GRAVITY));
    transport * weights.cost_of_transport + tracking * weights.tracking + regularisation
}
