//! Sensitivities of gaits against solves with moved bounds.

#![allow(clippy::unwrap_used)]

use gait_optimizer::sensitivity::{BoundSensitivity, sensitivities};
use gait_optimizer::{
    CancelToken, GaitProblem, Mesh, SolveOptions, SolveOutcome, SolveStatus, Subject, TunedBounds, UnchangedBound,
    solve,
};

fn problem() -> GaitProblem {
    let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
    problem.settings.mesh = Mesh { ds2: 2, ds3: 2, ss2: 3, ss1: 5 };
    problem.bounds = TunedBounds::parse("a5=0.03,a7=28").unwrap();
    problem
}

fn options() -> SolveOptions {
    // Without margins, so that the moved problems differ in the bound alone.
    SolveOptions { tolerance: 1e-9, tightening_rounds: 0, initial_guesses: 1, ..SolveOptions::default() }
}

fn moved(problem: &GaitProblem, bound: &str, by: f64, from: &SolveOutcome) -> SolveOutcome {
    let mut moved = problem.clone();
    let place = TunedBounds::NAMES.iter().position(|name| *name == bound).unwrap();
    moved.bounds.set(bound, problem.bounds.to_array()[place] + by).unwrap();
    let solved = solve(&moved, Some(&from.warm_start), &options(), &mut |_| {}, &CancelToken::new()).unwrap();
    assert_eq!(solved.report.status, SolveStatus::Converged, "{bound} {by}");
    solved
}

/// A step that keeps the active constraints.
fn step(bound: &BoundSensitivity) -> f64 {
    let (low, high) = bound.interval;
    let room = [low.map(|low| bound.value - low), high.map(|high| high - bound.value)];
    let room = room.into_iter().flatten().fold(f64::INFINITY, f64::min);
    (0.2 * room).min(1e-3 * bound.value.abs())
}

#[test]
fn active_bounds_are_those_whose_change_changes_the_gait() {
    let solved = solve(&problem(), None, &options(), &mut |_| {}, &CancelToken::new()).unwrap();
    let found = sensitivities(&problem(), &solved.warm_start, &options()).unwrap();
    let is_active = |(bound, interval): (&BoundSensitivity, &UnchangedBound)| {
        assert_eq!(
            !bound.active.is_empty(),
            interval.is_active(bound.value, &problem().settings.limits),
            "{bound:?} {interval:?}"
        );
        if bound.active.is_empty() {
            assert_eq!(bound.interval, (interval.least, interval.most), "{bound:?} {interval:?}");
        }
        !bound.active.is_empty()
    };
    let active = found.bounds.iter().zip(&solved.report.unchanged_bounds).map(is_active);
    assert!(active.filter(|active| *active).count() >= 2);
}

#[test]
fn derivatives_agree_with_solves_of_moved_bounds() {
    let problem = problem();
    let solved = solve(&problem, None, &options(), &mut |_| {}, &CancelToken::new()).unwrap();
    assert_eq!(solved.report.status, SolveStatus::Converged);
    let found = sensitivities(&problem, &solved.warm_start, &options()).unwrap();
    let mut compared = 0;
    for bound in &found.bounds {
        if bound.active.is_empty() {
            assert!(bound.derivatives.objective.abs() < 1e-6, "{bound:?}");
            continue;
        }
        // A stricter bound cannot lower the objective.
        let place = TunedBounds::NAMES.iter().position(|name| *name == bound.bound).unwrap();
        let strictness = if TunedBounds::IS_LOWER[place] { 1.0 } else { -1.0 };
        assert!(strictness * bound.derivatives.objective > 0.0, "{bound:?}");
        let step = step(bound);
        if bound.is_weakly_active || step < 1e-7 * bound.value.abs() {
            continue;
        }
        let (more, less) = (moved(&problem, bound.bound, step, &solved), moved(&problem, bound.bound, -step, &solved));
        let rate = |of: fn(&SolveOutcome) -> f64| (of(&more) - of(&less)) / (2.0 * step);
        for (name, derivative, expected) in [
            ("objective", bound.derivatives.objective, rate(|outcome| outcome.report.objective)),
            ("cost", bound.derivatives.cost_of_transport, rate(|outcome| outcome.report.cost_of_transport)),
            ("RMSE", bound.derivatives.gait_rmse_rad, rate(|outcome| outcome.report.gait_rmse_rad)),
        ] {
            println!("{} {name}: {derivative:.6e} {expected:.6e}, step {step:.1e}", bound.bound);
            let error = (derivative - expected).abs() / expected.abs();
            assert!(error < 1e-2, "{} {name}: {derivative} {expected}", bound.bound);
        }
        compared += 1;
    }
    for sentence in found.sentences(gait_optimizer::DisplayAngleUnit::Radian) {
        println!("{sentence}");
    }
    assert!(compared >= 2, "{compared}");
}

#[test]
fn sensitivities_do_not_depend_on_the_run() {
    let problem = problem();
    let solved = solve(&problem, None, &options(), &mut |_| {}, &CancelToken::new()).unwrap();
    let first = sensitivities(&problem, &solved.warm_start, &options()).unwrap();
    assert!(first == sensitivities(&problem, &solved.warm_start, &options()).unwrap());
    let mut other = problem.clone();
    other.settings.mesh.ss1 = 6;
    assert!(sensitivities(&other, &solved.warm_start, &options()).is_err());
}
