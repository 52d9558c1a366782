//! Golden gaits: an independent implementation's solutions of the same programme (`tests/data/README.md`).

#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

use gait_optimizer::gait_problem::{GaitProgramme, PointVariables, gait_of};
use gait_optimizer::metrics::gait_rmse;
use gait_optimizer::nlp::{self, BoundMultiplierStart, NlpSettings, NlpStatus, NonlinearProgram, StartPoint};
use gait_optimizer::{Device, GaitProblem, GaitSettings, ReferenceGait, Subject, TunedBounds};
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

struct Golden {
    programme: GaitProgramme,
    x: Vec<f64>,
    data: Value,
}

fn golden(subject: u32, muscles: bool) -> Golden {
    let letter = if muscles { "m" } else { "n" };
    let path = format!("{}/tests/data/golden_s{subject}_{letter}.json", env!("CARGO_MANIFEST_DIR"));
    let data: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let programme = GaitProgramme::new(
        &Subject::builtin(subject).unwrap(),
        &Device::ampro3().unwrap(),
        &TunedBounds::default(),
        muscles,
        &GaitSettings::reference_problem(),
        &ReferenceGait::builtin().unwrap(),
    )
    .unwrap();
    let layout = &programme.layout;
    let mut x = vec![0.0; layout.variables];
    let put = |x: &mut Vec<f64>, index: usize, value: f64| x[index] = value / layout.scale[index];
    for (d, domain) in layout.domains.iter().enumerate() {
        let source = &data["domains"][d];
        let row = |key: &str, k: usize| numbers(&source[key][k]);
        for k in 0..domain.points {
            let mut force = [0.0; 5];
            force[..domain.contacts].copy_from_slice(&row("lam", k));
            let ten = |key: &str| if muscles { row(key, k).try_into().unwrap() } else { [0.0; 10] };
            let point = PointVariables {
                q: row("q", k).try_into().unwrap(),
                qd: row("dq", k).try_into().unwrap(),
                qdd: row("ddq", k).try_into().unwrap(),
                u: row("u", k).try_into().unwrap(),
                force,
                fibre_length: ten("lce_norm"),
                fibre_velocity: ten("vce"),
                activation: ten("act"),
            };
            layout.set_point_variables(&mut x, d, k, &point);
        }
        put(&mut x, domain.duration, source["T"].as_f64().unwrap());
        put(&mut x, domain.phase_start, source["pa"].as_f64().unwrap());
        if let Some(end) = domain.phase_end {
            put(&mut x, end, source["pb"].as_f64().unwrap());
        }
        for j in 0..domain.outputs.len() {
            for (i, value) in numbers(&source["alpha"][j]).into_iter().enumerate() {
                put(&mut x, domain.bezier_coefficient(j, i), value);
            }
        }
        if let Some(impulse) = domain.impulse {
            for (c, value) in numbers(&source["impulse"]).into_iter().enumerate() {
                put(&mut x, impulse + c, value);
            }
        }
    }
    for (i, value) in numbers(&data["vhip"]).into_iter().enumerate() {
        put(&mut x, layout.hip_velocities + i, value);
    }
    put(&mut x, layout.right_step_length, data["xL"].as_f64().unwrap());
    put(&mut x, layout.stride_length, data["D"].as_f64().unwrap());
    Golden { programme, x, data }
}

#[test]
fn residuals_of_the_golden_gaits() {
    for (subject, muscles) in [(1, false), (1, true), (2, false), (2, true)] {
        let golden = golden(subject, muscles);
        let mut g = vec![0.0; golden.programme.rows()];
        golden.programme.constraints(&golden.x, &mut g);
        for (i, name) in golden.programme.rows.names.iter().enumerate() {
            let (low, high) = (golden.programme.rows.lower[i], golden.programme.rows.upper[i]);
            let violation = (low - g[i]).max(g[i] - high).max(0.0);
            assert!(violation < 1e-6, "subject {subject} muscles {muscles} {}: {violation}", name.label());
        }
        let (mut lower, mut upper) = (vec![0.0; golden.x.len()], vec![0.0; golden.x.len()]);
        golden.programme.variable_bounds(&mut lower, &mut upper);
        for i in 0..golden.x.len() {
            let violation = (lower[i] - golden.x[i]).max(golden.x[i] - upper[i]);
            assert!(violation < 1e-6, "subject {subject} muscles {muscles} variable {i}: {violation}");
        }
        let objective = golden.programme.objective(&golden.x);
        let theirs = golden.data["obj"].as_f64().unwrap();
        assert!((objective - theirs).abs() < 1e-10, "{objective} {theirs}");
    }
}

/// What a solve may take that begins at its answer.
const HANDFUL: usize = 5;

#[test]
fn the_solver_stays_at_the_golden_gaits() {
    for (subject, muscles) in [(1, false), (1, true), (2, false), (2, true)] {
        let golden = golden(subject, muscles);
        let settings = NlpSettings {
            tolerance: 1e-6,
            // The barrier at which the golden solver stopped (tolerance / 11).
            mu_initial: 1e-6 / 11.0,
            bound_push: 1e-9,
            bound_fraction: 1e-9,
            bound_multiplier_start: BoundMultiplierStart::Centred,
            linear_solver: nlp::LinearSolver::Auto,
            max_iterations: HANDFUL,
            ..NlpSettings::default()
        };
        let result =
            nlp::solve(&golden.programme, &StartPoint::Cold(golden.x.clone()), &settings, &mut |_| {}, &|| false)
                .unwrap();
        println!(
            "s{subject} {muscles} {:?} {} iterations {:?} {:?}",
            result.status, result.iterations, result.timing, result.counts
        );
        assert_eq!(result.status, NlpStatus::Converged);
        let theirs = golden.data["obj"].as_f64().unwrap();
        assert!((result.objective - theirs).abs() < 1e-6 * theirs, "{} {theirs}", result.objective);
    }
}

#[test]
fn gait_rmse_of_the_golden_gaits() {
    for (subject, muscles) in [(1, false), (1, true), (2, false), (2, true)] {
        let golden = golden(subject, muscles);
        let problem = GaitProblem::new(Subject::builtin(subject).unwrap(), muscles).unwrap();
        let gait = gait_of(&problem, &golden.programme, &golden.x);
        let rmse = gait_rmse(&gait, &problem.reference);
        let theirs = golden.data["gait_rmse"].as_f64().unwrap();
        assert!((rmse.total - theirs).abs() < 1e-9, "subject {subject} muscles {muscles}: {} {theirs}", rmse.total);
        for (ours, theirs) in rmse.parts.iter().zip(numbers(&golden.data["gait_rmse_parts"])) {
            assert!((ours - theirs).abs() < 1e-9, "{ours} {theirs}");
        }
    }
}
