//! Warm starts against cold starts after changing one bound of Table I.
//!
//! `cargo run --release -p gait-optimizer --example warm_starts -- [--subject 1] [--muscles on] [--changes 20] [--seed 1]
//! [--cold on] [--threads 1]`: solves the default problem, then for each random one-bound change solves warm from it
//! (and cold, for comparison, with `--cold on`), one CSV row each, medians at the end.

mod arguments;
mod median;
mod splitmix;
mod tuned_actions;

use arguments::argument;
use gait_optimizer::{
    CancelToken, GaitProblem, SolveOptions, SolveOutcome, SolveStatus, Subject, TunedBounds, WarmStart, solve,
};
use median::median;
use splitmix::SplitMix;
use std::error::Error;
use tuned_actions::LEVELS;

fn run(problem: &GaitProblem, warm: Option<&WarmStart>, threads: usize) -> Result<SolveOutcome, Box<dyn Error>> {
    let options = SolveOptions { threads, ..SolveOptions::default() };
    Ok(solve(problem, warm, &options, &mut |_| {}, &CancelToken::new())?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let subject: u32 = argument("--subject", "1").parse()?;
    let muscles = argument("--muscles", "on") == "on";
    let changes: usize = argument("--changes", "20").parse()?;
    let with_cold = argument("--cold", "on") == "on";
    let threads: usize = argument("--threads", "1").parse()?;
    let mut random = SplitMix(argument("--seed", "1").parse()?);
    let base = GaitProblem::new(Subject::builtin(subject)?, muscles)?;
    let start = run(&base, None, threads)?;
    eprintln!(
        "base: {:?} {} iterations {:.2} s",
        start.report.status, start.report.iterations, start.report.seconds_total
    );
    println!(
        "bound,value,warm_status,warm_from,warm_iterations,warm_seconds,warm_objective,warm_rmse,cold_status,cold_iterations,cold_seconds,cold_objective,cold_rmse"
    );
    let (mut warm_seconds, mut warm_iterations) = (Vec::new(), Vec::new());
    let (mut cold_seconds, mut cold_iterations) = (Vec::new(), Vec::new());
    let mut worst_ratio = 0.0_f64;
    let default = TunedBounds::default().to_array();
    for _ in 0..changes {
        let bound = random.below(8);
        let others: Vec<f64> = LEVELS[bound].iter().copied().filter(|&v| v != default[bound]).collect();
        let value = others[random.below(others.len())];
        let mut action = default;
        action[bound] = value;
        let problem = GaitProblem { bounds: TunedBounds::from_array(action)?, ..base.clone() };
        let warm = run(&problem, Some(&start.warm_start), threads)?.report;
        print!(
            "{},{value},{:?},{:?},{},{:.3},{:.8},{:.4}",
            TunedBounds::NAMES[bound],
            warm.status,
            warm.started_from,
            warm.iterations,
            warm.seconds_total,
            warm.objective,
            warm.gait_rmse_rad
        );
        if warm.status == SolveStatus::Converged {
            warm_seconds.push(warm.seconds_total);
            warm_iterations.push(warm.iterations as f64);
        }
        if with_cold {
            let cold = run(&problem, None, threads)?.report;
            println!(
                ",{:?},{},{:.3},{:.8},{:.4}",
                cold.status, cold.iterations, cold.seconds_total, cold.objective, cold.gait_rmse_rad
            );
            cold_seconds.push(cold.seconds_total);
            cold_iterations.push(cold.iterations as f64);
            worst_ratio = worst_ratio.max(warm.seconds_total / cold.seconds_total);
        } else {
            println!(",,,,,");
        }
    }
    eprintln!(
        "median warm {} iterations {:.3} s ({} of {changes} converged); median cold {} iterations {:.3} s; worst warm/cold {worst_ratio:.2}",
        median(&mut warm_iterations),
        median(&mut warm_seconds),
        warm_seconds.len(),
        median(&mut cold_iterations),
        median(&mut cold_seconds),
    );
    Ok(())
}
