//! The iterations of the interior-point method do not allocate memory.

#![allow(clippy::unwrap_used)]

use allocation_counter::measure;
use gait_optimizer::{
    CancelToken, GaitProblem, GaitSettings, InitialGuess, Mesh, SolveOptions, Subject, solve_from_guesses,
};

/// Numbers of allocations and of iterations of a cold solve that ends at its iteration limit.
fn allocations(problem: &GaitProblem, max_iterations: usize) -> (u64, usize) {
    let options = SolveOptions { max_iterations, ..SolveOptions::default() };
    let mut iterations = 0;
    let counted = measure(|| {
        let outcome =
            solve_from_guesses(problem, &[InitialGuess::NATURAL], &options, &mut |_| {}, &CancelToken::new()).unwrap();
        iterations = outcome.report.iterations;
    });
    (counted.count_total, iterations)
}

#[test]
fn iterations_do_not_allocate() {
    for muscles in [false, true] {
        let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), muscles).unwrap();
        problem.settings = GaitSettings { mesh: Mesh { ds2: 3, ds3: 3, ss2: 4, ss1: 4 }, ..GaitSettings::default() };
        let (few, at_first) = allocations(&problem, 20);
        let (many, later) = allocations(&problem, 60);
        assert!(later >= at_first + 20, "{at_first} {later}");
        // The report of the end differs by up to about thirty allocations. An allocation in each iteration would add
        // more.
        let (more, iterations) = (many.abs_diff(few), later - at_first);
        assert!(more < iterations as u64, "{more} allocations in {iterations} iterations more (muscles: {muscles})");
    }
}
