//! Excess between the nodes: certificates of gaits of random actions of Table I, before and after solving on with
//! tightened bounds.
//!
//! `cargo run --release -p gait-optimizer --example inter_node_excess -- [--subject 1] [--muscles on] [--draws 20] [--seed 1]
//! [--threads 1]`: one CSV row each, counts and medians at the end.

mod arguments;
mod median;
mod splitmix;
mod tuned_actions;

use arguments::argument;
use gait_optimizer::certificate::certify;
use gait_optimizer::{
    CancelToken, Gait, GaitProblem, SolveOptions, SolveOutcome, SolveStatus, Subject, TunedBounds, WarmStart, solve,
};
use median::median;
use splitmix::SplitMix;
use std::error::Error;
use tuned_actions::LEVELS;

/// Objections in one cell; empty: passed.
fn failures(gait: &Gait) -> Result<String, Box<dyn Error>> {
    Ok(certify(gait)?.failures.join("; ").replace(',', ""))
}

fn main() -> Result<(), Box<dyn Error>> {
    let subject: u32 = argument("--subject", "1").parse()?;
    let muscles = argument("--muscles", "on") == "on";
    let draws: usize = argument("--draws", "20").parse()?;
    let threads: usize = argument("--threads", "1").parse()?;
    let mut random = SplitMix(argument("--seed", "1").parse()?);
    let base = GaitProblem::new(Subject::builtin(subject)?, muscles)?;
    let run = |problem: &GaitProblem, warm: Option<&WarmStart>, tightening_rounds| {
        let options = SolveOptions { threads, tightening_rounds, ..SolveOptions::default() };
        solve(problem, warm, &options, &mut |_| {}, &CancelToken::new())
    };
    println!(
        "bounds,iterations,seconds,objective,rmse,failures,more_iterations,more_seconds,tightened,objective_after,rmse_after,failures_after"
    );
    let (mut passed, mut passed_after, mut solved) = (0, 0, 0);
    let (mut more_iterations, mut shares, mut costs) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..draws {
        let action = LEVELS.map(|levels| levels[random.below(levels.len())]);
        let problem = GaitProblem { bounds: TunedBounds::from_array(action)?, ..base.clone() };
        let before = run(&problem, None, 0)?;
        let words = action.map(|value| value.to_string()).join(" ");
        if before.report.status != SolveStatus::Converged {
            println!("{words},{},,,,{:?},,,,,,", before.report.iterations, before.report.status);
            continue;
        }
        let after = run(&problem, Some(&before.warm_start), SolveOptions::default().tightening_rounds)?;
        let (old, new) = (failures(&before.gait)?, failures(&after.gait)?);
        let figures = |o: &SolveOutcome| {
            let r = &o.report;
            format!("{},{:.3},{:.8},{:.4}", r.iterations, r.seconds_total, r.objective, r.gait_rmse_rad)
        };
        let r = &after.report;
        println!(
            "{words},{},{old},{},{:.3},{},{:.8},{:.4},{new}",
            figures(&before),
            r.iterations,
            r.seconds_total,
            r.tightened_bounds,
            r.objective,
            r.gait_rmse_rad
        );
        solved += 1;
        passed += usize::from(old.is_empty());
        passed_after += usize::from(new.is_empty());
        if r.tightened_bounds > 0 {
            more_iterations.push(r.iterations as f64);
            shares.push(r.seconds_total / before.report.seconds_total);
            costs.push(r.objective / before.report.objective - 1.0);
        }
    }
    eprintln!(
        "{solved} of {draws} converged; certificates passed: {passed} at nodes only, {passed_after} with bounds tightened; tightened: {}, of these in the median {} iterations more, {:.2} of the cold time, cost {:+.2} %",
        more_iterations.len(),
        median(&mut more_iterations),
        median(&mut shares),
        100.0 * median(&mut costs)
    );
    Ok(())
}
