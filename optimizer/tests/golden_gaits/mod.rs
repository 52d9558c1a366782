//! The golden gaits (`tests/data/README.md`) as points of the gait problem.

#![allow(dead_code)] // Each test file uses some of it.

use gait_optimizer::gait_problem::{GaitProgram, PointVariables, gait_of};
use gait_optimizer::{Device, Gait, GaitProblem, GaitSettings, ReferenceGait, Subject, TunedBounds};
use serde_json::Value;

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

pub(crate) struct Golden {
    pub(crate) program: GaitProgram,
    pub(crate) x: Vec<f64>,
    pub(crate) data: Value,
}

/// As a point of the program that the golden gaits solve.
pub(crate) fn golden(subject: u32, muscles: bool) -> Golden {
    golden_with(&GaitSettings::reference_problem(), subject, muscles)
}

pub(crate) fn golden_with(settings: &GaitSettings, subject: u32, muscles: bool) -> Golden {
    let letter = if muscles { "m" } else { "n" };
    let path = format!("{}/tests/data/golden_s{subject}_{letter}.json", env!("CARGO_MANIFEST_DIR"));
    let data: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let program = GaitProgram::new(
        &Subject::builtin(subject).unwrap(),
        &Device::ampro3().unwrap(),
        &TunedBounds::default(),
        muscles,
        settings,
        &ReferenceGait::builtin().unwrap(),
    )
    .unwrap();
    let layout = &program.layout;
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
    Golden { program, x, data }
}

/// A golden gait in physical units, with its problem.
pub(crate) fn golden_gait(subject: u32, muscles: bool) -> (GaitProblem, Gait) {
    let golden = golden(subject, muscles);
    let problem = GaitProblem::new(Subject::builtin(subject).unwrap(), muscles).unwrap();
    let gait = gait_of(&problem, &golden.program, &golden.x);
    (problem, gait)
}
