//! The objective: smoothed cost of transport, regularisation, and tracking of the reference gait.
//!
//! `f = w_cot E / (m g D) + w_track track + reg` with composite Simpson weights w_k and
//!
//! - `E = sum_domains T sum_k w_k sum_i (sqrt(P_i^2 + eps^2) - eps)`, over the six joint powers `P_i = u_i qd_(3+i)`,
//! - `reg = sum_domains T (sum_k w_k (weighted squares) + (1/N) sum (weighted squares of bends))`, where the bend of an
//!   activation is its second difference `s_(k-1) - 2 s_k + s_(k+1)` over adjacent nodes of a domain,
//! - `track = sum_domains (1/K) sum_k |q[2..] - q_ref|^2`.

use super::layout::{FORCE, Q, QD, QDD, U};
use super::program_data::GaitProgram;
use super::sparse_entries::Entries;
use crate::body::{COORDINATES, GRAVITY, JOINTS};
use crate::muscle::MUSCLE_COUNT;
use crate::settings::Regularisation;

/// The parts of the objective before weighting.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ObjectiveParts {
    /// Smoothed cost of transport E / (m g D).
    pub smoothed_cost_of_transport: f64,
    /// Smoothed mechanical effort E of a stride, J.
    pub energy_j: f64,
    /// Regularisation, with its weights.
    pub regularisation: f64,
    /// Tracking.
    pub tracking: f64,
}

/// A regularised variable: offset in the variables of a node, and weight of its square in physical units.
fn squares(program: &GaitProgram, d: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
    let layout = &program.layout.domains[d];
    let weights = &program.regularisation;
    let torque = weights.torque / (100.0 * 100.0);
    let acceleration = weights.acceleration / (30.0 * 30.0);
    let force = weights.contact_force / (500.0 * 500.0);
    let muscles = if program.layout.muscles { MUSCLE_COUNT } else { 0 };
    (0..JOINTS)
        .map(move |i| (U + i, torque))
        .chain((0..COORDINATES).map(move |i| (QDD + i, acceleration)))
        .chain((0..layout.contacts).map(move |i| (FORCE + i, force)))
        .chain((0..muscles).flat_map(move |m| {
            let v = program.muscles[m].max_speed;
            [
                (layout.activation() + m, weights.activation),
                (layout.fibre_velocity() + m, weights.fibre_velocity / (v * v)),
            ]
        }))
}

/// Coefficients of the bend of an activation at three adjacent nodes.
const BEND: [f64; 3] = [1.0, -2.0, 1.0];

/// The variables of each bend with the weight of its square; empty if the weight is zero.
fn bends(program: &GaitProgram, d: usize) -> impl Iterator<Item = ([usize; 3], f64)> + '_ {
    let domain = &program.layout.domains[d];
    let bends = if program.activations_are_coupled() { domain.points - 2 } else { 0 };
    let weight = program.regularisation.activation_bend / domain.intervals as f64;
    (0..bends).flat_map(move |k| {
        (0..MUSCLE_COUNT).map(move |m| {
            let activation = |i| domain.point(k + i) + domain.activation() + m;
            ([activation(0), activation(1), activation(2)], weight)
        })
    })
}

fn bend(program: &GaitProgram, x: &[f64], variables: [usize; 3]) -> f64 {
    (0..3).map(|i| BEND[i] * program.layout.value(x, variables[i])).sum()
}

/// `sqrt(P^2 + eps^2) - eps` with first and second derivative.
fn smooth_power(power: f64, smoothing: f64) -> [f64; 3] {
    let root = (power * power + smoothing * smoothing).sqrt();
    [root - smoothing, power / root, smoothing * smoothing / (root * root * root)]
}

/// Mean smoothed power of a domain, W, from the Simpson weight, torques and joint velocities of each node.
fn mean_power(
    nodes: impl Iterator<Item = (f64, [f64; JOINTS], [f64; JOINTS])>,
    regularisation: &Regularisation,
) -> f64 {
    let mut sum = 0.0;
    for (weight, torques, velocities) in nodes {
        for (torque, velocity) in torques.into_iter().zip(velocities) {
            sum += weight * smooth_power(torque * velocity, regularisation.power_smoothing_w)[0];
        }
    }
    sum
}

/// The parts.
pub(super) fn parts(program: &GaitProgram, x: &[f64]) -> ObjectiveParts {
    let layout = &program.layout;
    let mut result = ObjectiveParts::default();
    for (d, domain) in layout.domains.iter().enumerate() {
        let duration = layout.value(x, domain.duration);
        let (mut regularisation, mut tracking) = (0.0, 0.0);
        let nodes = (0..domain.points).map(|k| {
            let joints = |first: usize| std::array::from_fn(|i| layout.value(x, domain.point(k) + first + i));
            (domain.simpson(k), joints(U), joints(QD + 3))
        });
        let energy = mean_power(nodes, &program.regularisation);
        for k in 0..domain.points {
            let p = domain.point(k);
            let weight = domain.simpson(k);
            for (offset, c) in squares(program, d) {
                let value = layout.value(x, p + offset);
                regularisation += weight * c * value * value;
            }
            for (i, reference) in program.reference_angles[d][k].iter().enumerate() {
                let error = x[p + Q + 2 + i] - reference;
                tracking += error * error;
            }
        }
        for (variables, c) in bends(program, d) {
            regularisation += c * bend(program, x, variables).powi(2);
        }
        result.energy_j += duration * energy;
        result.regularisation += duration * regularisation;
        result.tracking += tracking / domain.points as f64;
    }
    let stride = layout.value(x, layout.stride_length);
    result.smoothed_cost_of_transport = result.energy_j / (program.model.total_mass * GRAVITY * stride);
    result
}

impl GaitProgram {
    /// Parts of the objective at x.
    pub fn objective_parts(&self, x: &[f64]) -> ObjectiveParts {
        parts(self, x)
    }
}

/// Weighted objective.
pub(super) fn value(program: &GaitProgram, x: &[f64]) -> f64 {
    let parts = parts(program, x);
    let weights = &program.weights;
    weights.cost_of_transport * parts.smoothed_cost_of_transport
        + weights.tracking * parts.tracking
        + parts.regularisation
}

/// Gradient with respect to the stored, scaled variables.
pub(super) fn gradient(program: &GaitProgram, x: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    let layout = &program.layout;
    let scale = &layout.scale;
    let stride = layout.value(x, layout.stride_length);
    let per_energy = program.weights.cost_of_transport / (program.model.total_mass * GRAVITY * stride);
    let mut total_energy = 0.0;
    for (d, domain) in layout.domains.iter().enumerate() {
        let duration = layout.value(x, domain.duration);
        let (mut energy, mut regularisation) = (0.0, 0.0);
        for k in 0..domain.points {
            let p = domain.point(k);
            let weight = domain.simpson(k);
            for i in 0..JOINTS {
                let (iu, iv) = (p + U + i, p + QD + 3 + i);
                let (u, v) = (layout.value(x, iu), layout.value(x, iv));
                let power = smooth_power(u * v, program.regularisation.power_smoothing_w);
                energy += weight * power[0];
                let factor = per_energy * duration * weight * power[1];
                out[iu] += factor * v * scale[iu];
                out[iv] += factor * u * scale[iv];
            }
            for (offset, c) in squares(program, d) {
                let index = p + offset;
                let value = layout.value(x, index);
                regularisation += weight * c * value * value;
                out[index] += 2.0 * duration * weight * c * value * scale[index];
            }
            let tracking = 2.0 * program.weights.tracking / domain.points as f64;
            for (i, reference) in program.reference_angles[d][k].iter().enumerate() {
                out[p + Q + 2 + i] += tracking * (x[p + Q + 2 + i] - reference);
            }
        }
        for (variables, c) in bends(program, d) {
            let bend = bend(program, x, variables);
            regularisation += c * bend * bend;
            for (index, coefficient) in variables.into_iter().zip(BEND) {
                out[index] += 2.0 * duration * c * bend * coefficient * scale[index];
            }
        }
        out[domain.duration] += (per_energy * energy + regularisation) * scale[domain.duration];
        total_energy += duration * energy;
    }
    out[layout.stride_length] -= per_energy * total_energy / stride * scale[layout.stride_length];
}

/// Hessian times sigma.
pub(super) fn hessian(program: &GaitProgram, x: &[f64], sigma: f64, out: &mut Entries<'_>) {
    let layout = &program.layout;
    let d_index = layout.stride_length;
    let stride = layout.value(x, d_index);
    let per_energy = sigma * program.weights.cost_of_transport / (program.model.total_mass * GRAVITY * stride);
    let mut total_energy = 0.0;
    for (d, domain) in layout.domains.iter().enumerate() {
        let duration = layout.value(x, domain.duration);
        let mut energy = 0.0;
        for k in 0..domain.points {
            let p = domain.point(k);
            let weight = domain.simpson(k);
            for i in 0..JOINTS {
                let (iu, iv) = (p + U + i, p + QD + 3 + i);
                let (u, v) = (layout.value(x, iu), layout.value(x, iv));
                let power = smooth_power(u * v, program.regularisation.power_smoothing_w);
                energy += weight * power[0];
                let factor = per_energy * duration * weight;
                out.hessian(iu, iu, factor * power[2] * v * v);
                out.hessian(iv, iv, factor * power[2] * u * u);
                out.hessian(iu, iv, factor * (power[2] * u * v + power[1]));
                for (index, by) in [(iu, power[1] * v), (iv, power[1] * u)] {
                    out.hessian(index, domain.duration, per_energy * weight * by);
                    out.hessian(index, d_index, -factor / stride * by);
                }
            }
            for (offset, c) in squares(program, d) {
                let index = p + offset;
                let slope = 2.0 * sigma * weight * c;
                out.hessian(index, index, slope * duration);
                out.hessian(index, domain.duration, slope * layout.value(x, index));
            }
            let tracking = 2.0 * sigma * program.weights.tracking / domain.points as f64;
            for i in 0..7 {
                out.hessian(p + Q + 2 + i, p + Q + 2 + i, tracking);
            }
        }
        for (variables, c) in bends(program, d) {
            let slope = 2.0 * sigma * c;
            let bend = bend(program, x, variables);
            for (i, index) in variables.into_iter().enumerate() {
                out.hessian(index, domain.duration, slope * bend * BEND[i]);
                for (other, coefficient) in variables.into_iter().zip(BEND).take(i + 1) {
                    out.hessian(index, other, slope * duration * BEND[i] * coefficient);
                }
            }
        }
        out.hessian(domain.duration, d_index, -per_energy * energy / stride);
        total_energy += duration * energy;
    }
    out.hessian(d_index, d_index, 2.0 * per_energy * total_energy / (stride * stride));
}
