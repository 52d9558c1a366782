//! Iterations and times of a sparse problem with every factorisation.
//!
//! `cargo run --release -p interior-point --example sparse_nlp [intervals [show]]`: a cart-pole swing-up with that many
//! intervals; with 0 intervals a synthetic problem of the size of a gait optimisation.

#[path = "../tests/standard_problems/mod.rs"]
mod standard_problems;

use interior_point::{LinearSolver, NlpIteration, NlpSettings, StartPoint, solve};

fn main() {
    let intervals = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(400);
    let verbose = std::env::args().nth(2).is_some();
    let problem = if intervals == 0 {
        standard_problems::sparse::gait_sized(8, 11)
    } else {
        standard_problems::sparse::cart_pole(intervals, 20.0, 1)
    };
    println!("{} variables, {} rows", problem.start.len(), problem.row_lower.len());
    let start = StartPoint::Cold(problem.start.clone());
    for (linear_solver, threads) in [
        (LinearSolver::Supernodal, 1),
        (LinearSolver::Multifrontal, 1),
        (LinearSolver::Multifrontal, 2),
        (LinearSolver::Auto, 1),
        (LinearSolver::DelayedPivots, 1),
    ] {
        let settings = NlpSettings { linear_solver, threads, ..NlpSettings::default() };
        let mut show = |it: &NlpIteration| {
            if verbose {
                println!(
                    "{:4} {:?} f={:.8e} viol={:.2e} dual={:.2e} compl={:.2e} mu={:.1e} a={:.1e}/{:.1e} dw={:.1e} dc={:.1e} ls={}",
                    it.number,
                    it.phase,
                    it.objective,
                    it.violation,
                    it.dual_infeasibility,
                    it.complementarity,
                    it.mu,
                    it.alpha_primal,
                    it.alpha_dual,
                    it.delta_w,
                    it.delta_c,
                    it.trials
                );
            }
        };
        match solve(&problem, &start, &settings, &mut show, &|| false) {
            Ok(r) => println!(
                "{linear_solver:?} x{threads}: {:?} f = {:.9} in {} iterations, {:?}\n   {:?}",
                r.status, r.objective, r.iterations, r.counts, r.timing
            ),
            Err(error) => println!("{error}"),
        }
    }
}
