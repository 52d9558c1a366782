//! The gait problem away from a solution matches independent sums, and its derivatives match finite differences.

#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

use gait_optimizer::gait_problem::row_names::RowPlace;
use gait_optimizer::gait_problem::{GaitProgram, RowKind, RowName};
use gait_optimizer::{Device, GaitSettings, ReferenceGait, Subject, TunedBounds};
use interior_point::NonlinearProgram;
use serde_json::Value;
use std::collections::BTreeMap;

fn fixture(name: &str) -> Value {
    let path = format!("{}/tests/data/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn program(muscles: bool, bounds: &TunedBounds) -> GaitProgram {
    GaitProgram::new(
        &Subject::builtin(1).unwrap(),
        &Device::ampro3().unwrap(),
        bounds,
        muscles,
        &GaitSettings::reference_problem(),
        &ReferenceGait::builtin().unwrap(),
    )
    .unwrap()
}

/// Every bound a tenth of its way from the default to the tightest value. A lower bound of 0 would hide the derivatives of
/// its row.
fn tight_bounds() -> TunedBounds {
    let mut values = TunedBounds::default().to_array();
    for (bound, value) in values.iter_mut().enumerate() {
        let (lowest, highest) = TunedBounds::RANGES[bound];
        let tightest = if TunedBounds::IS_LOWER[bound] { highest } else { lowest };
        *value += 0.1 * (tightest - *value);
    }
    TunedBounds::from_array(values).unwrap()
}

const DOMAINS: [&str; 8] = ["DS2_R", "DS3_R", "SS2_R", "SS1_R", "DS2_L", "DS3_L", "SS2_L", "SS1_L"];

/// The group of a row in the fixture.
fn group(name: RowName) -> String {
    use RowKind as K;
    match name.place {
        RowPlace::Point { domain, point } => {
            let domain = DOMAINS[domain];
            let suffix = match name.kind {
                K::Friction | K::Height | K::Clearance | K::PhaseRate => "ineq",
                K::TouchdownSpeed => "guardvel",
                K::PhaseEnd => "pb",
                K::MidpointPhase => "hs_p_mid",
                K::EndpointPhase => "hs_p",
                K::MidpointPhaseRate => "hs_v_mid",
                K::EndpointPhaseRate => "hs_v",
                K::MidpointFibre => "hs_lce_mid",
                K::EndpointFibre => "hs_lce",
                _ if point == 0 => "eq0",
                _ => "eq",
            };
            format!("{domain}:{suffix}")
        }
        RowPlace::Transition { domain } => {
            let (from, to) = (domain, (domain + 1) % 8);
            let suffix = match name.kind {
                K::PositionReset => "q",
                K::Impact => "imp",
                K::ImpactFriction => "impfric",
                K::VelocityReset => "dq",
                _ => "lce",
            };
            format!("{}->{}:{suffix}", DOMAINS[from], DOMAINS[to])
        }
        RowPlace::Stride => if name.kind == K::Speed { "speed" } else { "step" }.to_owned(),
    }
}

#[test]
fn gait_problem_matches_independent_sums() {
    for (name, muscles) in [("nlp_s1_n", false), ("nlp_s1_m", true)] {
        let data = fixture(name);
        let mut program = program(muscles, &TunedBounds::default());
        if let Some(height) = data["subject"]["H"].as_f64() {
            assert_eq!(height, 1.727);
        }
        let x = numbers(&data["x"]);
        assert_eq!(x.len(), program.variables());
        let mut g = vec![f64::NAN; program.rows()];
        program.constraints(&x, &mut g);
        assert!(g.iter().all(|v| v.is_finite()));
        let mut sums: BTreeMap<String, (usize, f64, f64, f64)> = BTreeMap::new();
        for (i, (row, value)) in program.rows.names.iter().zip(&g).enumerate() {
            // The fixture has rows dp_dot - minimum >= 0. Here the minimum is a bound of the row.
            let value = if row.kind == RowKind::PhaseRate { value - program.rows.lower[i] } else { *value };
            let entry = sums.entry(group(*row)).or_insert((0, 0.0, 0.0, 0.0));
            entry.0 += 1;
            entry.1 += value;
            entry.2 += value * value;
            entry.3 += value.abs();
        }
        let mut wrong = Vec::new();
        for expected in data["groups"].as_array().unwrap() {
            let key = expected[0].as_str().unwrap();
            let (count, sum, squares, absolute) = sums.remove(key).unwrap_or_default();
            let theirs = (expected[1].as_u64().unwrap(), expected[2].as_f64().unwrap(), expected[3].as_f64().unwrap());
            let close = |a: f64, b: f64, scale: f64| (a - b).abs() <= 1e-8 * scale.max(1.0);
            if count as u64 != theirs.0 || !close(sum, theirs.1, absolute) || !close(squares, theirs.2, squares) {
                wrong.push(format!("{name} {key}: ours {count} {sum} {squares}; fixture {theirs:?}"));
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        assert!(sums.is_empty(), "rows the fixture lacks: {sums:?}");
        program.weights.tracking = 1.0;
        let parts = program.objective_parts(&x);
        for (ours, key) in [
            (parts.smoothed_cost_of_transport, "mcot"),
            (parts.regularisation, "reg"),
            (parts.tracking, "track"),
            (parts.energy_j, "energy"),
        ] {
            let theirs = data[key].as_f64().unwrap();
            assert!((ours - theirs).abs() <= 1e-8 * theirs.abs().max(1.0), "{name} {key}: {ours} {theirs}");
        }
    }
}

/// Product of a compressed-column matrix with a vector.
fn multiply(pattern: &interior_point::SparsityPattern, values: &[f64], v: &[f64], symmetric: bool) -> Vec<f64> {
    let mut result = vec![0.0; pattern.rows];
    for column in 0..pattern.columns {
        for slot in pattern.column_starts[column]..pattern.column_starts[column + 1] {
            let row = pattern.row_indices[slot];
            result[row] += values[slot] * v[column];
            if symmetric && row != column {
                result[column] += values[slot] * v[row];
            }
        }
    }
    result
}

#[test]
fn derivatives_match_finite_differences() {
    for (name, muscles) in [("nlp_s1_n", false), ("nlp_s1_m", true)] {
        let x = numbers(&fixture(name)["x"]);
        let mut program = program(muscles, &tight_bounds());
        program.weights.tracking = 0.7;
        let (n, m) = (program.variables(), program.rows());
        let direction: Vec<f64> = (0..n).map(|i| (1.3 * i as f64).sin()).collect();
        let multipliers: Vec<f64> = (0..m).map(|i| (0.7 * i as f64 + 0.3).cos()).collect();
        let sigma = 1.7;
        let shifted = |h: f64| -> Vec<f64> { x.iter().zip(&direction).map(|(a, d)| a + h * d).collect() };
        let (jp, hp) = (program.jacobian_pattern().clone(), program.hessian_pattern().clone());

        let values_at = |h: f64| {
            let point = shifted(h);
            let mut g = vec![0.0; m];
            program.constraints(&point, &mut g);
            let mut jacobian = vec![0.0; jp.row_indices.len()];
            program.jacobian(&point, &mut jacobian);
            let mut lagrangian = vec![0.0; n];
            program.gradient(&point, &mut lagrangian);
            for v in &mut lagrangian {
                *v *= sigma;
            }
            for column in 0..n {
                for slot in jp.column_starts[column]..jp.column_starts[column + 1] {
                    lagrangian[column] += jacobian[slot] * multipliers[jp.row_indices[slot]];
                }
            }
            (g, jacobian, lagrangian, program.objective(&point))
        };
        let h = 1e-6;
        let (low, mid, high) = (values_at(-h), values_at(0.0), values_at(h));
        let product = multiply(&jp, &mid.1, &direction, false);
        for row in 0..m {
            let difference = (high.0[row] - low.0[row]) / (2.0 * h);
            let scale = 1.0 + difference.abs() + mid.0[row].abs();
            assert!(
                (difference - product[row]).abs() < 2e-6 * scale,
                "{name} {}: difference {difference}, Jacobian {}",
                program.rows.names[row].label(),
                product[row]
            );
        }
        let mut gradient = vec![0.0; n];
        program.gradient(&x, &mut gradient);
        let slope: f64 = gradient.iter().zip(&direction).map(|(a, b)| a * b).sum();
        let difference = (high.3 - low.3) / (2.0 * h);
        assert!((slope - difference).abs() < 1e-7 * (1.0 + slope.abs()), "{name} gradient {slope} {difference}");
        let mut hessian = vec![0.0; hp.row_indices.len()];
        program.hessian(&x, sigma, &multipliers, &mut hessian);
        let product = multiply(&hp, &hessian, &direction, true);
        for i in 0..n {
            let difference = (high.2[i] - low.2[i]) / (2.0 * h);
            assert!(
                (difference - product[i]).abs() < 1e-4 * (1.0 + difference.abs()),
                "{name} Hessian row {i}: difference {difference}, ours {}",
                product[i]
            );
        }
    }
}

#[test]
fn elimination_tree_covers_every_coupling() {
    for muscles in [false, true] {
        let program = program(muscles, &TunedBounds::default());
        let blocks = program.elimination_blocks().unwrap();
        let related = |mut a: usize, mut b: usize| {
            // The block with the larger number must be an ancestor of the other.
            if a > b {
                std::mem::swap(&mut a, &mut b);
            }
            let mut at = Some(a);
            while let Some(block) = at {
                if block == b {
                    return true;
                }
                at = blocks.parent[block];
            }
            false
        };
        let (jp, hp) = (program.jacobian_pattern(), program.hessian_pattern());
        for column in 0..program.variables() {
            for &row in &jp.row_indices[jp.column_starts[column]..jp.column_starts[column + 1]] {
                let (a, b) = (blocks.block_of_row[row], blocks.block_of_variable[column]);
                assert!(related(a, b), "{} with variable {column}", program.rows.names[row].label());
            }
            for &row in &hp.row_indices[hp.column_starts[column]..hp.column_starts[column + 1]] {
                let (a, b) = (blocks.block_of_variable[row], blocks.block_of_variable[column]);
                assert!(related(a, b), "variables {row} and {column}");
            }
        }
    }
}
