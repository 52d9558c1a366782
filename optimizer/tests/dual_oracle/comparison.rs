//! The gait problem matches a second implementation with dual numbers: values, Jacobian, gradient and Hessian of the
//! Lagrangian, away from solutions, with and without muscles, for both subjects and several meshes.

use crate::objective::{self, Weights};
use crate::random::Random;
use crate::rows::{self, Problem};
use crate::walker::Walker;
use crate::{Scalar, domains, muscles, variables};
use gait_optimizer::gait_problem::row_names::RowPlace;
use gait_optimizer::gait_problem::{GaitProgram, RowKind, RowName};
use gait_optimizer::settings::Regularisation;
use gait_optimizer::{Device, GaitSettings, Mesh, ReferenceGait, Subject, TunedBounds};
use interior_point::{NonlinearProgram, SparsityPattern};
use num_dual::{Dual64, HyperDual64};
use std::collections::{BTreeMap, HashMap};

/// A problem in both implementations.
struct Pair {
    name: String,
    production: GaitProgram,
    problem: Problem,
    weights: Weights,
    reference: Vec<Vec<[f64; 7]>>,
    muscles: bool,
    /// For each row of the second implementation, its index in the gait problem.
    row_of: Vec<usize>,
}

const STANDARD: [usize; 4] = [4, 4, 6, 6];

impl Pair {
    fn new(subject: u32, intervals: [usize; 4], muscles: bool, a5: f64) -> Self {
        let [ds2, ds3, ss2, ss1] = intervals;
        let regularisation = Regularisation { activation_bend: 0.3, ..Regularisation::default() };
        let settings = GaitSettings { mesh: Mesh { ds2, ds3, ss2, ss1 }, regularisation, ..GaitSettings::default() };
        let person = Subject::builtin(subject).unwrap();
        let bounds = TunedBounds { a5, ..TunedBounds::default() };
        let gait = ReferenceGait::builtin().unwrap();
        let mut production =
            GaitProgram::new(&person, &Device::ampro3().unwrap(), &bounds, muscles, &settings, &gait).unwrap();
        production.weights.tracking = 0.7;
        let (height, mass) = [(1.727, 65.7), (1.803, 75.0)][subject as usize - 1];
        let mut pair = Self {
            name: format!("subject {subject}, mesh {intervals:?}, muscles {muscles}"),
            production,
            problem: Problem {
                walker: Walker::new(height, mass),
                domains: domains::stride(intervals),
                muscles: muscles::table(),
                friction: 0.6,
                impact_friction: 0.6,
                clearance: a5.max(0.005),
            },
            weights: Weights {
                cost_of_transport: 1.0,
                tracking: 0.7,
                power_smoothing: 1.0,
                torque: 3e-3,
                acceleration: 1e-4,
                force: 1e-4,
                activation: 3e-3,
                fibre_velocity: 1e-2,
                activation_bend: 0.3,
            },
            reference: tracked_angles(&gait.angles_rad, intervals),
            muscles,
            row_of: Vec::new(),
        };
        let indices: HashMap<RowName, usize> =
            pair.production.rows.names.iter().enumerate().map(|(index, name)| (*name, index)).collect();
        assert_eq!(indices.len(), pair.production.rows(), "two rows share a name");
        let (written, _) = pair.second(&vec![0.5; pair.production.variables()]);
        pair.row_of = written
            .iter()
            .map(|(name, _)| {
                *indices.get(name).unwrap_or_else(|| panic!("the gait problem has no row {}", name.label()))
            })
            .collect();
        let mut once = pair.row_of.clone();
        once.sort_unstable();
        once.dedup();
        let is_missing = |row: &usize| once.binary_search(row).is_err();
        if let Some(row) = (0..pair.production.rows()).find(is_missing) {
            panic!("{}: `rows.rs` lacks the row {}", pair.name, pair.names()[row].label());
        }
        assert_eq!(once.len(), pair.row_of.len(), "{}: no row written twice", pair.name);
        pair
    }

    /// Rows and objective of the second implementation.
    fn second<D: Scalar>(&self, x: &[D]) -> (Vec<(RowName, D)>, D) {
        let gait = variables::read(&self.problem.domains, self.muscles, x);
        let value = objective::value(&self.problem, &self.weights, &self.reference, &gait);
        (rows::all(&self.problem, &gait), value)
    }

    /// The rows in the order of the gait problem, and the objective.
    fn ordered<D: Scalar>(&self, x: &[D]) -> (Vec<D>, D) {
        let (written, value) = self.second(x);
        let mut result = vec![value; written.len()];
        for ((_, row), &index) in written.into_iter().zip(&self.row_of) {
            result[index] = row;
        }
        (result, value)
    }

    fn names(&self) -> &[RowName] {
        &self.production.rows.names
    }

    /// A point far from any gait: variables of order one, positive durations and phase widths.
    fn anywhere(&self, random: &mut Random) -> Vec<f64> {
        let mut x = random.vector(self.production.variables());
        let layout = &self.production.layout;
        x[layout.stride_length] = random.between(0.8, 1.6);
        for domain in &layout.domains {
            x[domain.duration] = random.between(0.4, 2.0);
            if let Some(end) = domain.phase_end {
                x[end] = x[domain.phase_start] + random.between(0.4, 1.0);
            }
            if self.muscles {
                for k in 0..domain.points {
                    let p = domain.point(k);
                    for m in 0..10 {
                        x[p + domain.fibre_length() + m] = random.between(0.4, 1.5);
                        x[p + domain.activation() + m] = random.between(0.0, 1.0);
                    }
                }
            }
        }
        x
    }

    /// The fixture's point: a solved gait disturbed by 0.01 sin(k).
    fn disturbed_gait(&self) -> Vec<f64> {
        let letter = if self.muscles { "m" } else { "n" };
        let path = format!("{}/tests/data/nlp_s1_{letter}.json", env!("CARGO_MANIFEST_DIR"));
        let data: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        data["x"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
    }
}

/// Reference angles at the nodes: domain boundaries at 0, 7, 12, 33, 50 % of each step's half stride.
fn tracked_angles(table: &[[f64; 5]], intervals: [usize; 4]) -> Vec<Vec<[f64; 7]>> {
    let boundaries = [0.0, 0.07, 0.12, 0.33, 0.50];
    let at = |fraction: f64, column: usize| {
        let position = 100.0 * (fraction - fraction.floor());
        let low = (0..100).rev().find(|&row| row as f64 <= position).unwrap();
        let share = position - low as f64;
        (1.0 - share) * table[low][column] + share * table[low + 1][column]
    };
    (0..8)
        .map(|d| {
            let points = 2 * intervals[d % 4] + 1;
            (0..points)
                .map(|k| {
                    let sigma = k as f64 / (points - 1) as f64;
                    let (from, to) = (boundaries[d % 4], boundaries[d % 4 + 1]);
                    let fraction = if d < 4 { 0.0 } else { 0.5 } + from + sigma * (to - from);
                    let own = [0, 1, 2, 3, 4].map(|column| at(fraction, column));
                    // Right knee and ankle are the left ones shifted by half a stride.
                    [own[0], own[1], own[2], own[3], own[4], at(fraction + 0.5, 2), at(fraction + 0.5, 3)]
                })
                .collect()
        })
        .collect()
}

/// The problems and points of all comparisons.
fn each_case(mut check: impl FnMut(&Pair, &[f64], &mut Random)) {
    let mut random = Random::new(20220917);
    for (subject, intervals, muscles, a5) in [
        (1, STANDARD, false, 0.0),
        (1, STANDARD, true, 0.0),
        (2, STANDARD, false, 0.02),
        (2, STANDARD, true, 0.02),
        (1, [1, 2, 3, 5], true, 0.013),
        (2, [3, 1, 2, 1], false, 0.0),
    ] {
        let pair = Pair::new(subject, intervals, muscles, a5);
        let mut points = vec![pair.anywhere(&mut random), pair.anywhere(&mut random)];
        if intervals == STANDARD {
            points.push(pair.disturbed_gait());
        }
        for x in points {
            assert_eq!(x.len(), pair.production.variables());
            check(&pair, &x, &mut random);
        }
    }
}

/// (row, column, value) of a compressed matrix.
fn entries<'a>(pattern: &'a SparsityPattern, values: &'a [f64]) -> impl Iterator<Item = (usize, usize, f64)> + 'a {
    (0..pattern.columns).flat_map(move |column| {
        (pattern.column_starts[column]..pattern.column_starts[column + 1])
            .map(move |slot| (pattern.row_indices[slot], column, values[slot]))
    })
}

#[test]
fn values_match_dual_numbers() {
    each_case(|pair, x, _| {
        let (expected, objective) = pair.ordered(x);
        let mut ours = vec![f64::NAN; pair.production.rows()];
        pair.production.constraints(x, &mut ours);
        for (row, name) in pair.names().iter().enumerate() {
            let scale = expected[row].abs().max(1.0);
            assert!(
                (ours[row] - expected[row]).abs() <= 1e-10 * scale,
                "{}: {}: {} {}",
                pair.name,
                name.label(),
                ours[row],
                expected[row]
            );
        }
        let value = pair.production.objective(x);
        assert!((value - objective).abs() <= 1e-12 * objective.abs(), "{}: objective {value} {objective}", pair.name);
    });
}

#[test]
fn jacobian_and_gradient_match_dual_numbers() {
    each_case(|pair, x, random| {
        let (n, m) = (pair.production.variables(), pair.production.rows());
        let pattern = pair.production.jacobian_pattern().clone();
        let mut jacobian = vec![0.0; pattern.row_indices.len()];
        pair.production.jacobian(x, &mut jacobian);
        let mut gradient = vec![0.0; n];
        pair.production.gradient(x, &mut gradient);
        for _ in 0..4 {
            let direction = random.vector(n);
            let dual: Vec<Dual64> = x.iter().zip(&direction).map(|(&x, &d)| Dual64::new(x, d)).collect();
            let (expected, objective) = pair.ordered(&dual);
            let (mut ours, mut size) = (vec![0.0; m], vec![0.0; m]);
            for (row, column, value) in entries(&pattern, &jacobian) {
                ours[row] += value * direction[column];
                size[row] += (value * direction[column]).abs();
            }
            for (row, name) in pair.names().iter().enumerate() {
                assert!(
                    (ours[row] - expected[row].eps).abs() <= 1e-9 * size[row].max(1e-3),
                    "{}: {}: {} {}",
                    pair.name,
                    name.label(),
                    ours[row],
                    expected[row].eps
                );
            }
            let slope: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
            let size: f64 = gradient.iter().zip(&direction).map(|(g, d)| (g * d).abs()).sum();
            assert!((slope - objective.eps).abs() <= 1e-9 * size, "{}: gradient {slope} {}", pair.name, objective.eps);
        }
    });
}

/// d' H e of the gait problem, and the sum of the absolute values of its terms.
fn curvature(
    pair: &Pair,
    x: &[f64],
    sigma: f64,
    multipliers: &[f64],
    d: &[f64],
    e: &[f64],
    values: &mut [f64],
) -> (f64, f64) {
    pair.production.hessian(x, sigma, multipliers, values);
    let (mut sum, mut size) = (0.0, 0.0);
    for (row, column, value) in entries(pair.production.hessian_pattern(), values) {
        let term =
            if row == column { value * d[row] * e[row] } else { value * (d[row] * e[column] + d[column] * e[row]) };
        sum += term;
        size += term.abs();
    }
    (sum, size)
}

/// The domain of a group of rows, for messages and for parts of the Hessian.
fn group(name: RowName) -> (String, usize) {
    let domain = match name.place {
        RowPlace::Point { domain, .. } | RowPlace::Transition { domain } => domain,
        RowPlace::Stride => 8,
    };
    (format!("{:?}", name.kind), domain)
}

/// Rows with second derivatives that are not all zero: rows with rotations, phases, muscle curves or products with a
/// duration. The phase of the Bezier curves depends on the state in SS1 only.
fn is_curved(kind: RowKind, domain: usize) -> bool {
    let ss1 = domain % 4 == 3;
    match kind {
        RowKind::OutputPosition => return ss1,
        RowKind::HipPhase => return !ss1,
        _ => {}
    }
    !matches!(
        kind,
        RowKind::Friction
            | RowKind::ImpactFriction
            | RowKind::PositionReset
            | RowKind::VelocityReset
            | RowKind::FibreReset
            | RowKind::HipVelocity
            | RowKind::HipAcceleration
            | RowKind::PhaseRate
            | RowKind::PhaseEnd
            | RowKind::StepLength
    )
}

#[test]
fn hessian_of_the_lagrangian_matches_dual_numbers() {
    each_case(|pair, x, random| {
        let (n, m) = (pair.production.variables(), pair.production.rows());
        let mut values = vec![0.0; pair.production.hessian_pattern().row_indices.len()];
        let mut groups: BTreeMap<(String, usize), Vec<usize>> = BTreeMap::new();
        for (row, name) in pair.names().iter().enumerate() {
            groups.entry(group(*name)).or_default().push(row);
        }
        for _ in 0..2 {
            let (d, e) = (random.vector(n), random.vector(n));
            let multipliers = random.vector(m);
            let sigma = 1.7;
            let hyper: Vec<HyperDual64> = (0..n).map(|i| HyperDual64::new(x[i], d[i], e[i], 0.0)).collect();
            let (expected, objective) = pair.ordered(&hyper);
            // The whole Lagrangian.
            let second: f64 = sigma * objective.eps1eps2
                + expected.iter().zip(&multipliers).map(|(row, lambda)| lambda * row.eps1eps2).sum::<f64>();
            let (ours, size) = curvature(pair, x, sigma, &multipliers, &d, &e, &mut values);
            assert!((ours - second).abs() <= 1e-10 * size, "{}: Lagrangian {ours} {second}", pair.name);
            // The objective, then each kind of row in each domain, so that large terms do not hide small errors.
            let (ours, size) = curvature(pair, x, 1.0, &vec![0.0; m], &d, &e, &mut values);
            let second = objective.eps1eps2;
            assert!((ours - second).abs() <= 1e-9 * size, "{}: objective {ours} {second}", pair.name);
            for (key, members) in &groups {
                let mut alone = vec![0.0; m];
                for &row in members {
                    alone[row] = multipliers[row];
                }
                let second: f64 = members.iter().map(|&row| multipliers[row] * expected[row].eps1eps2).sum();
                let (ours, size) = curvature(pair, x, 0.0, &alone, &d, &e, &mut values);
                assert!(
                    (ours - second).abs() <= 1e-8 * size.max(1e-6),
                    "{}: {key:?}: {ours} {second}, terms {size}",
                    pair.name
                );
                let kind = pair.names()[members[0]].kind;
                assert_eq!(is_curved(kind, key.1), size > 0.0, "{}: {key:?} has terms of size {size}", pair.name);
            }
        }
    });
}

/// The comparison can fail: one wrong derivative is far outside the tolerances.
#[test]
fn comparison_detects_a_wrong_entry() {
    let pair = Pair::new(1, [1, 1, 1, 1], true, 0.0);
    let mut random = Random::new(3);
    let x = pair.anywhere(&mut random);
    let (n, m) = (pair.production.variables(), pair.production.rows());
    let (d, e, multipliers) = (random.vector(n), random.vector(n), random.vector(m));
    let mut values = vec![0.0; pair.production.hessian_pattern().row_indices.len()];
    let (right, size) = curvature(&pair, &x, 1.0, &multipliers, &d, &e, &mut values);
    // The multiplier of one contact acceleration row, changed by 0.1 %.
    let row = pair.names().iter().position(|name| name.kind == RowKind::ContactAcceleration).unwrap();
    let mut changed = multipliers.clone();
    changed[row] += 1e-3;
    let (wrong, _) = curvature(&pair, &x, 1.0, &changed, &d, &e, &mut values);
    assert!((right - wrong).abs() > 1e-10 * size, "{right} {wrong} {size}");
}
