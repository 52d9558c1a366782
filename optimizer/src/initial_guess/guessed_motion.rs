//! The motion of the initial guess: Bezier fits of the postures in each domain, their derivatives, and torques and
//! forces consistent with the contacts.

use super::guess_settings::GuessSettings;
use crate::body::{InverseDynamics, PointState};
use crate::gait_problem::{GaitProgram, PointVariables};
use crate::muscle::MUSCLE_COUNT;
use crate::walking::{BEZIER_COEFFICIENTS, basis};
use nalgebra::{DMatrix, DVector};

/// Largest velocity (rad/s) and acceleration (rad/s²) of the initial guess.
const RATE_LIMIT: f64 = 8.0;
const ACCELERATION_LIMIT: f64 = 40.0;
/// Damping of the least-squares torques and forces.
const DAMPING: f64 = 1e-3;

/// Writes a motion through the postures `q[domain][node]` to a scaled vector of variables.
pub fn guess(program: &GaitProgram, postures: &[Vec<[f64; 9]>], settings: &GuessSettings) -> Vec<f64> {
    let layout = &program.layout;
    let mut x = vec![0.0; layout.variables];
    let put = |x: &mut [f64], index: usize, value: f64| x[index] = value / layout.scale[index];
    let speed = settings.stride_length_m / settings.stride_time_s;
    for (d, domain) in layout.domains.iter().enumerate() {
        let share = program.stride_fraction(d, 1.0) - program.stride_fraction(d, 0.0);
        let duration = share * settings.stride_time_s;
        put(&mut x, domain.duration, duration);
        let coefficients = fit(&postures[d]);
        for k in 0..domain.points {
            let b = basis(domain.sigma(k));
            let along = |r: usize, coordinate: usize| -> f64 {
                (0..BEZIER_COEFFICIENTS).map(|i| b[r][i] * coefficients[coordinate][i]).sum()
            };
            let mut point = PointVariables {
                q: postures[d][k],
                qd: [0.0; 9],
                qdd: [0.0; 9],
                u: [0.0; 6],
                force: [0.0; 5],
                fibre_length: [1.0; MUSCLE_COUNT],
                fibre_velocity: [0.0; MUSCLE_COUNT],
                activation: [0.1; MUSCLE_COUNT],
            };
            for coordinate in 0..9 {
                point.qd[coordinate] = (along(1, coordinate) / duration).clamp(-RATE_LIMIT, RATE_LIMIT);
                point.qdd[coordinate] =
                    (along(2, coordinate) / (duration * duration)).clamp(-ACCELERATION_LIMIT, ACCELERATION_LIMIT);
            }
            torques_and_forces(program, d, &mut point);
            layout.set_point_variables(&mut x, d, k, &point);
        }
        for (j, &output) in domain.outputs.iter().enumerate() {
            for i in 0..BEZIER_COEFFICIENTS {
                put(&mut x, domain.bezier_coefficient(j, i), coefficients[output][i]);
            }
        }
        put(&mut x, domain.phase_start, program.hip_phase_of(d, &postures[d][0]));
        if let Some(end) = domain.phase_end {
            put(&mut x, end, program.hip_phase_of(d, &postures[d][domain.last()]));
        }
    }
    for i in 0..4 {
        put(&mut x, layout.hip_velocities + i, speed);
    }
    put(&mut x, layout.right_step_length, 0.5 * settings.stride_length_m);
    put(&mut x, layout.stride_length, settings.stride_length_m);
    x
}

/// Least-squares Bezier coefficients of each coordinate at equidistant nodes.
fn fit(postures: &[[f64; 9]]) -> [[f64; BEZIER_COEFFICIENTS]; 9] {
    let points = postures.len();
    let matrix = DMatrix::from_fn(points, BEZIER_COEFFICIENTS, |k, i| basis(k as f64 / (points - 1) as f64)[0][i]);
    // Slight damping towards the adjacent coefficients makes the fit unique on coarse meshes.
    let mut normal = matrix.transpose() * &matrix;
    for i in 1..BEZIER_COEFFICIENTS {
        for (a, b, sign) in [(i, i, 1.0), (i - 1, i - 1, 1.0), (i, i - 1, -1.0), (i - 1, i, -1.0)] {
            normal[(a, b)] += 1e-6 * sign;
        }
    }
    let factor = normal.cholesky();
    let mut result = [[0.0; BEZIER_COEFFICIENTS]; 9];
    for (coordinate, row) in result.iter_mut().enumerate() {
        let rhs = matrix.transpose() * DVector::from_fn(points, |k, _| postures[k][coordinate]);
        if let Some(factor) = &factor {
            row.copy_from_slice(factor.solve(&rhs).as_slice());
        }
    }
    result
}

/// Torques and forces at a node by damped least squares of `M qdd + h = B u + J^T lambda`, clipped to their bounds.
fn torques_and_forces(program: &GaitProgram, d: usize, point: &mut PointVariables) {
    let state = PointState::new(&point.q, &point.qd, &point.qdd);
    let motion = InverseDynamics::new(&program.model).rows(&state);
    let contacts = program.layout.domains[d].contacts;
    let columns = 6 + contacts;
    // Unknowns are in units of 100 N m and 500 N.
    let mut matrix = DMatrix::<f64>::zeros(9, columns);
    for i in 0..6 {
        matrix[(3 + i, i)] = 100.0;
    }
    for (c, contact) in program.layout.domains[d].domain.contact_rows().into_iter().enumerate() {
        let foot_point = crate::gait_problem::rows::foot_point_index(contact.point, contact.side);
        let (_, gradient) = program.foot_point_linearised(&state, foot_point, contact.axis);
        for (i, value) in gradient.into_iter().enumerate() {
            matrix[(i, 6 + c)] = 500.0 * value;
        }
    }
    let rhs = DVector::from_fn(9, |i, _| motion[i]);
    let mut normal = matrix.transpose() * &matrix;
    let scale = DAMPING * 100.0 * 100.0;
    for i in 0..columns {
        normal[(i, i)] += scale;
    }
    let Some(factor) = normal.cholesky() else { return };
    let solution = factor.solve(&(matrix.transpose() * rhs));
    for i in 0..6 {
        point.u[i] = (100.0 * solution[i]).clamp(-100.0, 100.0);
    }
    for (c, contact) in program.layout.domains[d].domain.contact_rows().into_iter().enumerate() {
        let value = 500.0 * solution[6 + c];
        point.force[c] = match contact.axis {
            crate::body::Axis::X => value.clamp(-200.0, 200.0),
            crate::body::Axis::Z => value.clamp(20.0, 1500.0),
        };
    }
}
