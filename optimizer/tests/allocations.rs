//! The iteration loop of the interior point works in memory that was allocated before it.

#![allow(clippy::unwrap_used)]

use allocation_counter::measure;
use gait_optimizer::{
    CancelToken, ColdGuess, GaitProblem, GaitSettings, Mesh, SolveOptions, Subject, solve_from_guesses,
};

/// Allocations of a cold solve that ends at its limit of iterations, and the iterations.
fn allocations(problem: &GaitProblem, max_iterations: usize) -> (u64, usize) {
    let options = SolveOptions { max_iterations, ..SolveOptions::default() };
    let mut iterations = 0;
    let counted = measure(|| {
        let outcome =
            solve_from_guesses(problem, &[ColdGuess::NATURAL], &options, &mut |_| {}, &CancelToken::new()).unwrap();
        iterations = outcome.report.iterations;
    });
    (counted.count_total, iterations)
}

#[test]
fn an_iteration_allocates_nothing() {
    for muscles in [false, true] {
        let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), muscles).unwrap();
        problem.settings = GaitSettings { mesh: Mesh { ds2: 3, ds3: 3, ss2: 4, ss1: 4 }, ..GaitSettings::default() };
        let (few, at_first) = allocations(&problem, 20);
        let (many, later) = allocations(&problem, 60);
        assert!(later >= at_first + 20, "{at_first} {later}");
        // What is written about where it ended differs by up to some thirty; an allocation in each iteration would be one for
        // each.
        let (more, iterations) = (many.abs_diff(few), later - at_first);
        assert!(more < iterations as u64, "{more} allocations in {iterations} iterations more (muscles: {muscles})");
    }
}
