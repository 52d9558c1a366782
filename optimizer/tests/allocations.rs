//! The iterations of the interior-point method do not allocate memory.

#![allow(clippy::unwrap_used)]

use allocation_counter::measure;
use gait_optimizer::gait_problem::GaitProgram;
use gait_optimizer::{
    CancelToken, GaitProblem, GaitSettings, InitialGuess, Mesh, NlpSettings, SolveOptions, Subject, WarmPoint,
    solve_from_guesses,
};
use interior_point::{StartPoint, solve};

/// Numbers of allocations and of iterations of a solve that ends at its iteration limit.
fn allocations(program: &GaitProgram, start: &WarmPoint, max_iterations: usize) -> (u64, usize) {
    let settings = NlpSettings { max_iterations, tolerance: 1e-14, ..NlpSettings::default() };
    let start = StartPoint::Warm(start.clone());
    let mut iterations = 0;
    let counted = measure(|| {
        iterations = solve(program, &start, &settings, &mut |_| {}, &|| false).unwrap().iterations;
    });
    (counted.count_total, iterations)
}

#[test]
fn iterations_do_not_allocate() {
    for muscles in [false, true] {
        let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), muscles).unwrap();
        problem.settings = GaitSettings { mesh: Mesh { ds2: 3, ds3: 3, ss2: 4, ss1: 4 }, ..GaitSettings::default() };
        let options = SolveOptions { max_iterations: 10, ..SolveOptions::default() };
        let begun =
            solve_from_guesses(&problem, &[InitialGuess::NATURAL], &options, &mut |_| {}, &CancelToken::new()).unwrap();
        let program = GaitProgram::new(
            &problem.subject,
            &problem.device,
            &problem.bounds,
            muscles,
            &problem.settings,
            &problem.reference,
        )
        .unwrap();
        let counts = [10, 30, 50].map(|limit| allocations(&program, &begun.warm_start.point, limit));
        assert_eq!(counts.map(|count| count.1), [10, 30, 50]);
        // The list of the filter doubles now and then. The first iterations can build another factorisation.
        assert!(counts[2].0 - counts[1].0 <= 2, "muscles: {muscles}, {counts:?}");
    }
}
