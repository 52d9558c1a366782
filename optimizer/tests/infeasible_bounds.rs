//! Solves with bounds that no gait satisfies. Errors in linear algebra or restoration phase show here as solves that
//! end without a stationary point.

#![allow(clippy::unwrap_used)]

use gait_optimizer::{
    CancelToken, GaitProblem, GaitSettings, InitialGuess, Mesh, SolveOptions, SolveStatus, Subject, TunedBounds,
    solve_from_guesses,
};

/// Bounds far tighter than Table I (Li et al. 2022); in each case one or two of them are infeasible.
const WITHOUT_A_GAIT: [&str; 12] = [
    "a2=10",
    "a1=2,a5=0.15",
    "a2=10,a8=5",
    "a2=20,a4=0.35",
    "a4=0.35,a5=0.3",
    "a4=0.35,a6=0.02",
    "a6=0,a7=5",
    "a4=0.35,a7=10",
    "a4=0.5,a7=5",
    "a5=0.3,a6=0",
    "a5=0.3,a7=5",
    "a2=10,a4=0.35",
];

/// Largest number of solves that may end without a stationary point of the violation, because paths depend on rounding.
const MAY_GIVE_UP: usize = 1;

#[test]
fn infeasible_solves_end_at_stationary_points_of_the_violation() {
    let long = !skipped_tests::long_tests_are_skipped(" to run more than six starts on a coarse mesh");
    let options = SolveOptions { threads: 2, ..SolveOptions::default() };
    let mut gave_up = Vec::new();
    let guesses = [InitialGuess::NATURAL, InitialGuess::EARLY_RISE];
    let starts = WITHOUT_A_GAIT.into_iter().flat_map(|words| guesses.map(|guess| (words, guess)));
    for (words, guess) in if long { starts.take(24) } else { starts.take(6) } {
        let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
        problem.bounds = TunedBounds::parse(words).unwrap();
        if !long {
            problem.settings = GaitSettings { mesh: Mesh { ds2: 3, ds3: 3, ss2: 4, ss1: 4 }, ..problem.settings };
        }
        let outcome = solve_from_guesses(&problem, &[guess], &options, &mut |_| {}, &CancelToken::new()).unwrap();
        let report = outcome.report;
        println!(
            "{words}, {}: {:?} after {} iterations, {:.1} s, violation {:.2e}",
            guess.label(),
            report.status,
            report.iterations,
            report.seconds_total,
            report.max_violation
        );
        assert_ne!(report.status, SolveStatus::Converged, "{words}");
        assert!(report.max_violation > 1e-4, "{words}: {}", report.max_violation);
        if report.status == SolveStatus::Infeasible {
            assert!(!outcome.violations.is_empty(), "{words}: nothing is named");
        } else {
            gave_up.push((words, guess.label()));
        }
    }
    assert!(gave_up.len() <= MAY_GIVE_UP, "gave up on {gave_up:?}");
}

/// Near the boundary of feasibility steps become very short, and the restoration phase must take over.
#[test]
fn long_nearly_infeasible_solve_ends_before_its_iteration_limit() {
    if skipped_tests::long_tests_are_skipped("") {
        return;
    }
    let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), true).unwrap();
    let options = SolveOptions { threads: 2, ..SolveOptions::default() };
    // The boundary of feasibility is between 14 and 15.
    for (bound, has_gaits) in [("a2=14", false), ("a2=15", true)] {
        problem.bounds = TunedBounds::parse(bound).unwrap();
        let ends = [InitialGuess::NATURAL, InitialGuess::EARLY_RISE].map(|guess| {
            let outcome = solve_from_guesses(&problem, &[guess], &options, &mut |_| {}, &CancelToken::new()).unwrap();
            println!("{bound}, {}: {:?}", guess.label(), outcome.report.status);
            outcome.report.status
        });
        assert!(ends.iter().all(|end| *end != SolveStatus::IterationLimit), "{bound}: {ends:?}");
        assert_eq!(ends.contains(&SolveStatus::Converged), has_gaits, "{bound}: {ends:?}");
    }
}
