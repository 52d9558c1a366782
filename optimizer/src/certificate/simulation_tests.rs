//! Tests of the simulation against mechanics and finite differences, on a gait of a coarse mesh.

use super::dormand_prince::System;
use super::feedback_linearization::{BANDWIDTH, Control, State, join, split};
use super::hybrid_walker::HybridWalker;
use super::limit_excess::AllowedRanges;
use super::residuals::{residuals, residuals_on};
use super::return_map::return_map;
use crate::body::{Chain, GRAVITY, PointState, WalkerModel};
use crate::gait::between_nodes::instant;
use crate::walking::kinetic_energy;
use crate::{CancelToken, Gait, GaitProblem, Mesh, SolveOptions, SolveStatus, Subject, solve};
use std::sync::OnceLock;

fn gait() -> &'static Gait {
    static GAIT: OnceLock<Gait> = OnceLock::new();
    GAIT.get_or_init(|| {
        let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
        problem.settings.mesh = Mesh { ds2: 2, ds3: 2, ss2: 2, ss1: 4 };
        let options = SolveOptions { initial_guesses: 1, ..SolveOptions::default() };
        let outcome = solve(&problem, None, &options, &mut |_| {}, &CancelToken::new()).unwrap();
        assert_eq!(outcome.report.status, SolveStatus::Converged);
        outcome.gait
    })
}

fn model() -> WalkerModel {
    WalkerModel::new(&gait().subject, &gait().device).unwrap()
}

/// A state of each domain: its middle node, slightly off the virtual constraints.
fn states() -> Vec<State> {
    gait()
        .domains
        .iter()
        .map(|domain| {
            let k = domain.q.len() / 2;
            let mut x = join(&domain.q[k], &domain.qd[k]);
            for (i, value) in x.iter_mut().enumerate() {
                *value += 1e-2 * (i as f64).sin();
            }
            x
        })
        .collect()
}

fn controls(model: &WalkerModel) -> Vec<Control<'_>> {
    (0..8).map(|d| Control::new(model, gait(), d)).collect()
}

fn assert_derivative(exact: &State, value: impl Fn(&State) -> f64, x: &State) {
    for column in 0..18 {
        let moved = |change: f64| {
            let mut x = *x;
            x[column] += change;
            value(&x)
        };
        let difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
        assert!((difference - exact[column]).abs() < 1e-6 * (1.0 + exact.amax()), "{difference} {}", exact[column]);
    }
}

#[test]
fn derivatives_of_motion_and_guards_match_finite_differences() {
    let model = model();
    for (control, x) in controls(&model).iter().zip(states()) {
        let exact = control.derivative_by_state(&x).unwrap();
        for row in 0..18 {
            assert_derivative(&exact.row(row).transpose(), |x| control.derivative(x).unwrap()[row], &x);
        }
        let gradient = control.guard_gradient(&x).unwrap();
        assert_derivative(&gradient, |x| control.guard_value(x).unwrap(), &x);
    }
}

#[test]
fn accelerations_satisfy_contacts_and_output_dynamics() {
    let model = model();
    let limits = AllowedRanges::new(gait());
    for (d, (control, x)) in controls(&model).iter().zip(states()).enumerate() {
        let (q, qd) = split(&x);
        let qdd = control.acceleration(&x).unwrap();
        let state = PointState::new(&q, &qd, &qdd);
        for contact in &control.contacts {
            assert!(contact.acceleration(&state).abs() < 1e-9);
        }
        let phase = control.constraints.phase(&q, &qd, &qdd);
        for (&output, y) in control.constraints.outputs.iter().zip(control.constraints.desired(phase.s)) {
            let error = q[output] - y[0];
            let rate = qd[output] - y[1] * phase.rate;
            let acceleration = qdd[output] - y[2] * phase.rate.powi(2) - y[1] * phase.acceleration;
            let asked = -2.0 * BANDWIDTH * rate - BANDWIDTH * BANDWIDTH * error;
            assert!((acceleration - asked).abs() < 1e-8, "{} {output}", control.domain.name());
        }
        // Torques and forces satisfy all nine equations of motion.
        let plan = instant(&gait().domains[d], phase.s).u;
        let effort = control.effort(&x, &qdd, &plan, &limits).unwrap();
        let mut rest = crate::body::InverseDynamics::new(&model).rows(&state);
        for (contact, force) in control.contacts.iter().zip(&effort.forces) {
            for (value, gradient) in rest.iter_mut().zip(contact.gradient(&state)) {
                *value -= gradient * force;
            }
        }
        for (value, torque) in rest[3..].iter_mut().zip(effort.u) {
            *value -= torque;
        }
        assert!(rest.iter().all(|value| value.abs() < 1e-4), "{} {rest:?}", control.domain.name());
    }
}

#[test]
fn return_map_predicts_the_response_to_a_change_of_speed() {
    let model = model();
    let walker = HybridWalker::new(&model, gait());
    let start = join(&gait().domains[0].q[0], &gait().domains[0].qd[0]);
    let (periodic, regulated) = return_map(&walker, &start).unwrap();
    let free_walker = walker.with_free_hip_velocity();
    let (periodic, free) = return_map(&free_walker, &periodic).unwrap();
    // A proportional change of all velocities by 0.1 % preserves contacts and virtual constraints.
    let changed = |share: f64| {
        let x = State::from_fn(|i, _| if i < 9 { periodic[i] } else { periodic[i] * (1.0 + share) });
        free_walker.after_stride(&x).unwrap()
    };
    let rates = periodic.rows(9, 9);
    let carried = (changed(1e-3) - changed(-1e-3)).rows(9, 9) / 2e-3;
    let multiplier = carried.dot(&rates) / rates.norm_squared();
    assert!((multiplier - free.speed_kept).abs() < 1e-3 * free.speed_kept.abs());
    // The controller regulates the hip velocity in six of the eight domains, so almost nothing of the change remains.
    assert!(regulated.speed_kept.abs() < 1e-2 * multiplier);
}

/// Kinetic and potential energy, J.
fn energy(model: &WalkerModel, x: &State) -> f64 {
    let (q, qd) = split(x);
    let height = |chain: &Chain| chain.position(&q)[1];
    let potential: f64 = model.bodies.iter().map(|body| body.mass * GRAVITY * height(&body.com)).sum();
    kinetic_energy(model, &q, &qd) + potential
}

#[test]
fn energy_changes_by_the_work_of_the_joints() {
    let model = model();
    let limits = AllowedRanges::new(gait());
    let walker = HybridWalker::new(&model, gait());
    for (d, control) in walker.controls.iter().enumerate() {
        let domain = &gait().domains[d];
        let mut samples: Vec<(f64, f64, f64)> = Vec::new();
        let mut watch = |_: usize, time: f64, x: &State| {
            let qdd = control.acceleration(x).unwrap();
            let phase = control.constraints.phase(&split(x).0, &split(x).1, &qdd);
            let effort = control.effort(x, &qdd, &instant(domain, phase.s).u, &limits).unwrap();
            let power = effort.u.iter().enumerate().map(|(i, torque)| torque * x[12 + i]).sum();
            samples.push((time, power, energy(&model, x)));
        };
        walker.passage(d, &join(&domain.q[0], &domain.qd[0]), &mut watch).unwrap();
        let work: f64 = samples.windows(2).map(|w| 0.5 * (w[1].0 - w[0].0) * (w[0].1 + w[1].1)).sum();
        let gained = samples.last().unwrap().2 - samples[0].2;
        // The trapezoidal rule over the steps of the integrator.
        assert!((work - gained).abs() < 2e-3 * (1.0 + gained.abs()), "{}: {work} {gained}", domain.name);
    }
}

#[test]
fn finer_grid_finds_no_larger_violations_between_nodes() {
    let (coarse, fine) = (residuals(&model(), gait()), residuals_on(&model(), gait(), 400));
    let mut compared = 0;
    for (check, finer) in coarse.iter().zip(&fine).filter(|(check, _)| check.name.ends_with("between nodes")) {
        assert_eq!(check.name, finer.name);
        if let (Some(limit), Some(value), Some(more)) = (check.limit, check.value, finer.value) {
            assert!(more - value < 0.02 * limit, "{}: {value} and {more}, limit {limit}", check.name);
            compared += 1;
        }
    }
    assert!(compared > 10, "{compared}");
}
