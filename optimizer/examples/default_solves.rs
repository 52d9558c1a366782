//! The four default cold starts: results, runs, and the gap to the golden objectives.
//!
//! `cargo run --release -p gait-optimizer --example default_solves -- [-n | -m] [-v] [--threads 2] [--reference-problem]`;
//! `-n` without muscles only, `-m` with muscles only, `-v` prints every iteration to stderr. The golden objectives
//! belong to the reference problem, which has no weight on the bend of activations.

use gait_optimizer::{CancelToken, GaitProblem, GaitSettings, SolveOptions, Subject, solve};
use std::error::Error;

/// Objectives of an independent implementation (`tests/data/README.md`).
const GOLDEN: [(u32, bool, f64); 4] =
    [(1, false, 0.064_592_736_6), (1, true, 0.074_226_531_7), (2, false, 0.062_242_289_6), (2, true, 0.072_684_704_4)];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let has = |flag: &str| arguments.iter().any(|a| a == flag);
    let threads = match arguments.iter().position(|a| a == "--threads").and_then(|i| arguments.get(i + 1)) {
        Some(text) => text.parse()?,
        None => 2,
    };
    let verbose = has("-v");
    for (subject, muscles, golden) in GOLDEN {
        if has("-n") && muscles || has("-m") && !muscles {
            continue;
        }
        let mut problem = GaitProblem::new(Subject::builtin(subject)?, muscles)?;
        if has("--reference-problem") {
            problem.settings = GaitSettings::reference_problem();
        }
        let options = SolveOptions { threads, ..SolveOptions::default() };
        let mut observer = |r: &gait_optimizer::IterationRecord| {
            if verbose {
                eprintln!(
                    "{} {:?} {} objective {:.8} violation {:.1e} dual {:.1e} mu {:.1e} step {:.3}",
                    r.guess,
                    r.phase,
                    r.iteration,
                    r.objective,
                    r.constraint_violation,
                    r.dual_infeasibility,
                    r.barrier,
                    r.step
                );
            }
        };
        let outcome = solve(&problem, None, &options, &mut observer, &CancelToken::new())?;
        let r = &outcome.report;
        println!(
            "subject {subject} muscles {muscles}: {:?}, {} iterations, objective {:.8} ({:+.2} % of golden), cost of transport {:.6}, Gait RMSE {:.4}, violation {:.1e}, {:.2} s (evaluation {:.2}, linear algebra {:.2}), {:.4} m/s",
            r.status,
            r.iterations,
            r.objective,
            100.0 * (r.objective / golden - 1.0),
            r.cost_of_transport,
            r.gait_rmse_rad,
            r.max_violation,
            r.seconds_total,
            r.seconds_evaluation,
            r.seconds_linear_algebra,
            r.speed_m_s
        );
        for a in &r.solver_runs {
            println!(
                "   {}{}: {:?}, {} iterations, {:.2} s, objective {:.8}, Gait RMSE {:.4}",
                if a.chosen { "* " } else { "  " },
                a.strategy,
                a.status,
                a.iterations,
                a.seconds,
                a.objective,
                a.gait_rmse_rad
            );
        }
        for v in outcome.violations.iter().take(3) {
            println!("   {} {} {}", v.row, v.amount, v.unit);
        }
    }
    Ok(())
}
