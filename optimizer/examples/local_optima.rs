//! Local optima that initial guesses reach: objective, Gait RMSE and iterations.
//!
//! `cargo run --release -p gait-optimizer --example local_optima -- [--subjects 1,2] [--muscles on] [--threads 2] [--guesses
//! 14] [--grid off]`: solves from the first `--guesses` initial guesses, or with `--grid on` from a grid of timings,
//! knee flexions, strides and barrier parameters. Prints one CSV row for each.

mod arguments;

use arguments::argument;
use gait_optimizer::{CancelToken, GaitProblem, InitialGuess, SolveOptions, Subject, solve_from_guesses};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let threads: usize = argument("--threads", "2").parse()?;
    let muscles = argument("--muscles", "on") == "on";
    let mut guesses = InitialGuess::first(argument("--guesses", "14").parse()?, muscles);
    if argument("--grid", "off") == "on" {
        guesses.clear();
        for base in [InitialGuess::NATURAL, InitialGuess::EARLY_RISE] {
            for knee_flexion in [0.7, 1.0] {
                for (stride_time_s, stride_length_m) in [(1.2, 1.15), (1.1, 1.25), (1.0, 1.0)] {
                    for barrier in [1e-5, 1e-3] {
                        guesses.push(InitialGuess { knee_flexion, stride_time_s, stride_length_m, barrier, ..base });
                    }
                }
            }
        }
    }
    println!("subject,guess,status,iterations,seconds,objective,gait_rmse_rad");
    for subject in argument("--subjects", "1,2").split(',') {
        let problem = GaitProblem::new(Subject::builtin(subject.parse()?)?, muscles)?;
        for pair in guesses.chunks(threads) {
            let options = SolveOptions { threads, max_iterations: 500, ..SolveOptions::default() };
            let outcome = solve_from_guesses(&problem, pair, &options, &mut |_| {}, &CancelToken::new())?;
            for a in outcome.report.solver_runs {
                println!(
                    "{subject},\"{}\",{:?},{},{:.2},{:.8},{:.4}",
                    a.strategy, a.status, a.iterations, a.seconds, a.objective, a.gait_rmse_rad
                );
            }
        }
    }
    Ok(())
}
