//! The postures of the initial guess: inverse kinematics over the whole stride.
//!
//! Minimises `|q[2..] - q_ref|^2 + 0.3 (px - px0)^2 + w |second differences|^2` over all nodes of the stride, subject
//! to contact positions, non-negative heights of the other foot points, and joint ranges, by a short sequence of convex
//! QPs with linearised kinematics. If a QP is infeasible, slack variables with a penalty relax every row, because an
//! initial guess need not be feasible.

use super::guess_settings::GuessSettings;
use crate::body::{Axis, PointState};
use crate::gait_problem::GaitProgram;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// Weight of the forward position of the hip.
const HIP_WEIGHT: f64 = 0.3;
/// Weight of second differences, relative to the tracking weight 1.
const SMOOTHNESS: f64 = 30.0;
/// Penalty on the squared slack of a row (m or rad) if the QP is infeasible.
const ROW_PRICE: f64 = 1e4;
/// Largest number of linearisations.
const PASSES: usize = 8;
/// Largest change of a coordinate at convergence, m or rad. The contacts are then off by a few millimetres, which the
/// solver removes faster than another linearisation would.
const STEP_TOLERANCE: f64 = 0.05;

/// Tolerances of duality gap and residuals of a QP: 1/500 of the step at convergence.
const GUESS_TOLERANCE: f64 = 1e-4;

/// An instant of the stride: the nodes that share it.
struct StrideInstant {
    /// Domain and node.
    members: Vec<(usize, usize)>,
    fraction: f64,
}

/// The instants of the stride. The last node of a domain and the first node of the next one share an instant.
fn instants(program: &GaitProgram) -> Vec<StrideInstant> {
    let mut result: Vec<StrideInstant> = Vec::new();
    for (d, domain) in program.layout.domains.iter().enumerate() {
        for k in 0..domain.points {
            let fraction = program.stride_fraction(d, domain.sigma(k));
            match result.last_mut() {
                Some(last) if k == 0 && d > 0 => last.members.push((d, k)),
                _ => result.push(StrideInstant { members: vec![(d, k)], fraction }),
            }
        }
    }
    result
}

/// A sparse matrix under construction, as triplets.
#[derive(Default)]
struct Triplets {
    rows: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
}

impl Triplets {
    fn push(&mut self, row: usize, column: usize, value: f64) {
        self.rows.push(row);
        self.columns.push(column);
        self.values.push(value);
    }

    fn matrix(self, rows: usize, columns: usize) -> CscMatrix<f64> {
        CscMatrix::new_from_triplets(rows, columns, self.rows, self.columns, self.values)
    }
}

/// Treatment of the rows of a QP.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RowTreatment {
    /// Every row must hold.
    Hard,
    /// Slack variables with the penalty [`ROW_PRICE`] relax every row, so that the QP is feasible.
    Soft,
}

/// Coordinates of each node, `result[domain][node]`. They satisfy contacts and ranges as far as the bounds and the
/// linearisations allow, and less after a cancellation.
pub fn solve(program: &GaitProgram, guess: &GuessSettings, cancel: &dyn Fn() -> bool) -> Vec<Vec<[f64; 9]>> {
    let instants = instants(program);
    let stride = guess.stride_length_m;
    let speed = stride / guess.stride_time_s;
    let right_step = 0.5 * stride;
    let toe_left = program.model.left.toe_ahead_m;
    let targets: Vec<[f64; 9]> = instants
        .iter()
        .map(|instant| {
            let mut reference = program.reference_at(instant.fraction);
            for knee in [2, 5] {
                reference[knee] = reference[knee].clamp(0.05, 1.35);
            }
            let mut q = [0.0; 9];
            q[0] = -toe_left - 0.22 * stride + speed * instant.fraction * guess.stride_time_s;
            q[1] = 0.98
                * (program.model.left.thigh_length_m
                    + program.model.left.shank_length_m
                    + program.model.left.ankle_height_m);
            q[2..].copy_from_slice(&reference);
            q
        })
        .collect();
    let mut q = targets.clone();
    let torso = program.variable_range(program.layout.domains[0].point(0) + 2);
    let mut rows = RowTreatment::Hard;
    for pass in 0..PASSES {
        if cancel() {
            break;
        }
        let step_with = |rows| linearised_step(program, &instants, &targets, &q, right_step, stride, torso, rows);
        let mut step = step_with(rows);
        if step.is_none() && rows == RowTreatment::Hard {
            rows = RowTreatment::Soft;
            step = step_with(rows);
        }
        let Some(step) = step else { break };
        let mut largest = 0.0_f64;
        for (i, row) in q.iter_mut().enumerate() {
            for c in 0..9 {
                let change = step[9 * i + c].clamp(-0.5, 0.5);
                row[c] += change;
                largest = largest.max(change.abs());
            }
        }
        if largest < STEP_TOLERANCE && pass > 0 {
            break;
        }
    }
    let mut result: Vec<Vec<[f64; 9]>> = program.layout.domains.iter().map(|d| vec![[0.0; 9]; d.points]).collect();
    for (i, instant) in instants.iter().enumerate() {
        for &(d, k) in &instant.members {
            result[d][k] = q[i];
        }
    }
    result
}

/// Joint ranges of the initial guess, within those of the problem.
fn joint_range(coordinate: usize, torso: (f64, f64), hip_ankle: [(f64, f64); 9]) -> Option<(f64, f64)> {
    let (low, high) = match coordinate {
        0 | 1 => return None,
        2 => torso,
        4 | 7 => (0.03_f64, 1.4_f64),
        _ => (-0.5, 0.65),
    };
    let own = hip_ankle[coordinate];
    Some((low.max(own.0), high.min(own.1)))
}

/// The step of all nodes; `None` if the QP has no solution.
#[allow(clippy::too_many_arguments)] // one call
fn linearised_step(
    program: &GaitProgram,
    instants: &[StrideInstant],
    targets: &[[f64; 9]],
    q: &[[f64; 9]],
    right_step: f64,
    stride: f64,
    torso: (f64, f64),
    rows_are: RowTreatment,
) -> Option<Vec<f64>> {
    let count = instants.len();
    let coordinates = 9 * count;
    // Objective 1/2 x'Px + c'x of the step x.
    let mut p = Triplets::default();
    let mut c = vec![0.0; coordinates];
    for i in 0..count {
        for coordinate in 0..9 {
            let weight = match coordinate {
                0 => HIP_WEIGHT,
                1 => 1e-6,
                _ => 1.0,
            };
            p.push(9 * i + coordinate, 9 * i + coordinate, 2.0 * weight);
            c[9 * i + coordinate] += 2.0 * weight * (q[i][coordinate] - targets[i][coordinate]);
        }
    }
    // The last instant is the first one of the next stride: equality rows impose periodicity, and second differences
    // stay within the stride.
    for i in 1..count - 1 {
        let (before, after) =
            (instants[i].fraction - instants[i - 1].fraction, instants[i + 1].fraction - instants[i].fraction);
        let scale = 2.0 / (before + after);
        // Divided second difference, scaled to steps of 1/80 of a stride.
        let h = (1.0_f64 / 80.0).powi(2);
        let stencil = [h * scale / before, -h * scale * (1.0 / before + 1.0 / after), h * scale / after];
        for coordinate in 0..9 {
            let current: f64 = (0..3).map(|s| stencil[s] * q[i + s - 1][coordinate]).sum();
            for a in 0..3 {
                let ia = 9 * (i + a - 1) + coordinate;
                c[ia] += 2.0 * SMOOTHNESS * stencil[a] * current;
                for b in 0..=a {
                    let ib = 9 * (i + b - 1) + coordinate;
                    p.push(ib.min(ia), ib.max(ia), 2.0 * SMOOTHNESS * stencil[a] * stencil[b]);
                }
            }
        }
    }
    let mut equality = Triplets::default();
    let mut equality_rhs = Vec::new();
    let mut inequality = Triplets::default();
    let mut inequality_rhs = Vec::new();
    let ranges: [(f64, f64); 9] =
        std::array::from_fn(|coordinate| program.variable_range(program.layout.domains[0].point(0) + coordinate));
    for (i, instant) in instants.iter().enumerate() {
        let state = PointState::new(&q[i], &[0.0; 9], &[0.0; 9]);
        let last = i + 1 == count;
        let mut grounded = [false; 4];
        let within = !last;
        if within {
            for &(d, _) in &instant.members {
                for (contact, target, foot_point) in program.contact_targets_at(d, right_step, stride) {
                    let seen = grounded[foot_point] && contact.axis == Axis::Z;
                    let flat_x = contact.axis == Axis::X
                        && instant
                            .members
                            .iter()
                            .any(|&(other, _)| other < d && program.shares_contact(other, contact));
                    if seen || flat_x {
                        continue;
                    }
                    if contact.axis == Axis::Z {
                        grounded[foot_point] = true;
                    }
                    let (position, gradient) = program.foot_point_linearised(&state, foot_point, contact.axis);
                    let row = equality_rhs.len();
                    for (coordinate, value) in gradient.into_iter().enumerate() {
                        if value != 0.0 {
                            equality.push(row, 9 * i + coordinate, value);
                        }
                    }
                    equality_rhs.push(target - position);
                }
            }
            for (foot_point, on_ground) in grounded.iter().enumerate() {
                if *on_ground {
                    continue;
                }
                let (height, gradient) = program.foot_point_linearised(&state, foot_point, Axis::Z);
                let row = inequality_rhs.len();
                for (coordinate, value) in gradient.into_iter().enumerate() {
                    if value != 0.0 {
                        inequality.push(row, 9 * i + coordinate, -value);
                    }
                }
                inequality_rhs.push(height);
            }
        } else {
            for coordinate in 0..9 {
                let row = equality_rhs.len();
                equality.push(row, 9 * i + coordinate, 1.0);
                equality.push(row, coordinate, -1.0);
                let shift = if coordinate == 0 { stride } else { 0.0 };
                equality_rhs.push(q[0][coordinate] + shift - q[i][coordinate]);
            }
        }
        for coordinate in 2..9 {
            if let Some((low, high)) = joint_range(coordinate, torso, ranges) {
                for (sign, bound) in [(1.0, high), (-1.0, -low)] {
                    let row = inequality_rhs.len();
                    inequality.push(row, 9 * i + coordinate, sign);
                    inequality_rhs.push(bound - sign * q[i][coordinate]);
                }
            }
        }
    }
    let (ne, ni) = (equality_rhs.len(), inequality_rhs.len());
    let mut rows = equality;
    for k in 0..inequality.rows.len() {
        rows.push(ne + inequality.rows[k], inequality.columns[k], inequality.values[k]);
    }
    let mut rhs = equality_rhs;
    rhs.extend(inequality_rhs);
    let mut n = coordinates;
    if rows_are == RowTreatment::Soft {
        // One slack variable for each row.
        for row in 0..ne + ni {
            rows.push(row, n, -1.0);
            p.push(n, n, 2.0 * ROW_PRICE);
            n += 1;
        }
        c.resize(n, 0.0);
    }
    // Neither equilibration nor refinement: metres and radians have similar magnitudes, and the tolerance is loose.
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .equilibrate_enable(false)
        .iterative_refinement_enable(false)
        .max_iter(100)
        .tol_gap_abs(GUESS_TOLERANCE)
        .tol_gap_rel(GUESS_TOLERANCE)
        .tol_feas(GUESS_TOLERANCE)
        .build()
        .ok()?;
    let cones = [SupportedConeT::ZeroConeT(ne), SupportedConeT::NonnegativeConeT(ni)];
    let mut solver = DefaultSolver::new(&p.matrix(n, n), &c, &rows.matrix(ne + ni, n), &rhs, &cones, settings).ok()?;
    solver.solve();
    let solved = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
    solved.then(|| solver.solution.x[..coordinates].to_vec())
}
