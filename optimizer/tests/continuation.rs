//! Gaits that are followed from a root.

#![allow(clippy::unwrap_used)]

use gait_optimizer::{
    CancelToken, FollowedPath, GaitProblem, Mesh, Root, SolveError, SolveOptions, SolveOutcome, SolveStatus, Subject,
    TunedBounds, solve, solve_by_continuation,
};

fn problem(bounds: &str) -> GaitProblem {
    let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
    problem.settings.mesh = Mesh { ds2: 2, ds3: 2, ss2: 3, ss1: 5 };
    problem.bounds = TunedBounds::parse(bounds).unwrap();
    problem
}

fn options() -> SolveOptions {
    SolveOptions { initial_guesses: 1, ..SolveOptions::default() }
}

fn root() -> Root {
    let problem = problem("a5=0");
    let solved = solve(&problem, None, &options(), &mut |_| {}, &CancelToken::new()).unwrap();
    assert_eq!(solved.report.status, SolveStatus::Converged);
    Root { bounds: problem.bounds, solution: solved.warm_start }
}

fn followed(bounds: &str, root: &Root) -> (SolveOutcome, FollowedPath) {
    solve_by_continuation(&problem(bounds), root, &options(), &mut |_| {}, &CancelToken::new()).unwrap()
}

#[test]
fn root_continued_to_its_own_bounds_stays_as_it_is() {
    let root = root();
    let (same, path) = followed("a5=0", &root);
    assert_eq!((same.report.status, path.fold, path.refused_steps), (SolveStatus::Converged, None, 0));
    assert!(path.largest_change_rad < 1e-6, "{path:?}");
}

#[test]
fn continuation_gives_the_same_bits_with_more_threads() {
    let root = root();
    let with = |threads| {
        let options = SolveOptions { threads, ..options() };
        solve_by_continuation(&problem("a5=0.01"), &root, &options, &mut |_| {}, &CancelToken::new()).unwrap()
    };
    let ((one, path), (other, other_path)) = (with(1), with(2));
    assert_eq!((one.warm_start, path), (other.warm_start, other_path));
}

#[test]
fn root_that_is_no_solution_is_refused() {
    let mut root = root();
    let limited = SolveOptions { max_iterations: 1, ..options() };
    root.solution.point.x.iter_mut().for_each(|x| *x *= 0.5);
    let refused = solve_by_continuation(&problem("a5=0.01"), &root, &limited, &mut |_| {}, &CancelToken::new());
    assert!(matches!(refused, Err(SolveError::RootWithoutGait(_))));
}
