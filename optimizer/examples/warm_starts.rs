//! Comparison of warm starts and cold starts after changes of bounds of Table I.
//!
//! `cargo run --release -p gait-optimizer --example warm_starts -- [--subject 1] [--muscles on] [--changes 20] [--seed
//! 1] [--cold on] [--threads 1] [--at-once 1] [--from 20,90,0.3,1.4,0,0.5,50,40] [--values table|tight] [--active off]
//! [--starts 1]` solves with the bounds `--from`, then for each random change of `--at-once` bounds from that gait and, with
//! `--cold on`, cold. It prints one CSV row for each, and medians at the end. `--values tight` draws values far beyond Table I.
//! `--active on` draws only values with which the gait would not stay as it is. With `--starts 25`, the changes are spread
//! over as many gaits, of random actions of Table I, solved from the gait of `--from`.
//!
//! `warm_run` is the end of the warm start itself. `violation_stands` is its longest run of iterations in which the
//! smallest violation did not decrease to 0.9 times its value; `residuals_stand` is the same for the largest of
//! violation, dual infeasibility and barrier parameter, with 0.5.

mod arguments;
mod median;
mod splitmix;
mod tuned_actions;

use arguments::argument;
use gait_optimizer::{
    CancelToken, GaitProblem, IterationRecord, SolveOptions, SolveOutcome, SolvePhase, SolveStatus, Subject,
    TunedBounds, UnchangedBound, WarmStart, solve,
};
use median::median;
use splitmix::SplitMix;
use std::error::Error;
use tuned_actions::{LEVELS, TIGHT};

fn run(
    problem: &GaitProblem,
    warm: Option<&WarmStart>,
    threads: usize,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<SolveOutcome, Box<dyn Error>> {
    let options = SolveOptions { threads, ..SolveOptions::default() };
    Ok(solve(problem, warm, &options, observer, &CancelToken::new())?)
}

/// Largest number of draws until a change is found.
const DRAWS: usize = 10_000;

/// Changes `count` bounds to values outside the intervals of `unchanged`; `None` if too few bounds have such values.
fn changed(
    from: TunedBounds,
    count: usize,
    values: &[&[f64]; TunedBounds::COUNT],
    unchanged: &[UnchangedBound],
    random: &mut SplitMix,
) -> Option<(TunedBounds, String)> {
    for _ in 0..DRAWS {
        let mut action = from.to_array();
        let mut drawn = Vec::new();
        for _ in 0..DRAWS {
            if drawn.len() == count {
                break;
            }
            let bound = random.below(TunedBounds::COUNT);
            let stays = |value: f64| unchanged.get(bound).is_some_and(|unchanged| unchanged.contains(value));
            let others: Vec<f64> =
                values[bound].iter().copied().filter(|&v| v != from.to_array()[bound] && !stays(v)).collect();
            if drawn.contains(&bound) || others.is_empty() {
                continue;
            }
            action[bound] = others[random.below(others.len())];
            drawn.push(bound);
        }
        if drawn.len() < count {
            return None;
        }
        if let Ok(bounds) = TunedBounds::from_array(action) {
            let words = drawn.iter().map(|&bound| format!("{}={}", TunedBounds::NAMES[bound], action[bound]));
            return Some((bounds, words.collect::<Vec<_>>().join(" ")));
        }
    }
    None
}

fn random_bounds(random: &mut SplitMix) -> TunedBounds {
    loop {
        let action = LEVELS.map(|levels| levels[random.below(levels.len())]);
        if let Ok(bounds) = TunedBounds::from_array(action) {
            return bounds;
        }
    }
}

/// Longest run of iterations in which the smallest value did not decrease to this fraction of itself.
fn longest_stand(records: &[IterationRecord], share: f64, value: impl Fn(&IterationRecord) -> f64) -> usize {
    let (mut least, mut since, mut longest) = (f64::INFINITY, 0, 0);
    for (number, record) in records.iter().enumerate() {
        let now = value(record);
        if now <= share * least {
            (least, since) = (now, number);
        }
        longest = longest.max(number - since);
    }
    longest
}

fn main() -> Result<(), Box<dyn Error>> {
    let subject: u32 = argument("--subject", "1").parse()?;
    let muscles = argument("--muscles", "on") == "on";
    let changes: usize = argument("--changes", "20").parse()?;
    let with_cold = argument("--cold", "on") == "on";
    let threads: usize = argument("--threads", "1").parse()?;
    let at_once: usize = argument("--at-once", "1").parse()?;
    if !(1..=8).contains(&at_once) {
        return Err("--at-once: 1 to 8".into());
    }
    let active = argument("--active", "off") == "on";
    let starts: usize = argument("--starts", "1").parse()?;
    let values = match argument("--values", "table").as_str() {
        "table" => LEVELS,
        "tight" => TIGHT,
        other => return Err(format!("--values {other}: table or tight").into()),
    };
    let mut random = SplitMix(argument("--seed", "1").parse()?);
    let mut base = GaitProblem::new(Subject::builtin(subject)?, muscles)?;
    let from = argument("--from", "");
    if !from.is_empty() {
        let action: Vec<f64> = from.split(',').map(str::parse).collect::<Result<_, _>>()?;
        base.bounds = TunedBounds::from_array(action.try_into().map_err(|_| "--from: one number for each bound")?)?;
    }
    let root = run(&base, None, threads, &mut |_| {})?;
    eprintln!(
        "base: {:?} {} iterations {:.2} s",
        root.report.status, root.report.iterations, root.report.seconds_total
    );
    println!(
        "change,warm_run,warm_run_iterations,violation_stands,residuals_stand,warm_status,warm_from,warm_iterations,warm_seconds,warm_objective,warm_rmse,cold_status,cold_iterations,cold_seconds,cold_objective,cold_rmse"
    );
    let (mut warm_seconds, mut warm_iterations) = (Vec::new(), Vec::new());
    let (mut cold_seconds, mut cold_iterations) = (Vec::new(), Vec::new());
    let (mut worst_ratio, mut failed, mut more_iterations, mut done) = (0.0_f64, 0, 0, 0);
    let (mut here, mut start) = (base.clone(), root.clone());
    while done < changes {
        if starts > 1 && done % changes.div_ceil(starts) == 0 {
            here.bounds = random_bounds(&mut random);
            start = run(&here, Some(&root.warm_start), threads, &mut |_| {})?;
        }
        let unchanged = if active { &start.report.unchanged_bounds[..] } else { &[] };
        let change = changed(here.bounds, at_once, &values, unchanged, &mut random);
        let Some((bounds, words)) = change.filter(|_| start.report.status == SolveStatus::Converged) else {
            if starts > 1 {
                continue;
            }
            return Err("too few values change the gait".into());
        };
        done += 1;
        let problem = GaitProblem { bounds, ..base.clone() };
        let (mut iterations, mut own) = (Vec::new(), true);
        let warm = run(&problem, Some(&start.warm_start), threads, &mut |record| {
            own &= record.guess == 0 && matches!(record.phase, SolvePhase::Cost | SolvePhase::InterNode);
            if own {
                iterations.push(*record);
            }
        })?
        .report;
        let solver_run = warm.solver_runs.first().ok_or("a solve without runs")?;
        failed += usize::from(solver_run.status != SolveStatus::Converged);
        print!(
            "{words},{:?},{},{},{},{:?},{:?},{},{:.3},{:.8},{:.4}",
            solver_run.status,
            solver_run.iterations,
            longest_stand(&iterations, 0.9, |r| r.constraint_violation),
            longest_stand(&iterations, 0.5, |r| r.constraint_violation.max(r.dual_infeasibility).max(r.barrier)),
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
            let cold = run(&problem, None, threads, &mut |_| {})?.report;
            println!(
                ",{:?},{},{:.3},{:.8},{:.4}",
                cold.status, cold.iterations, cold.seconds_total, cold.objective, cold.gait_rmse_rad
            );
            cold_seconds.push(cold.seconds_total);
            cold_iterations.push(cold.iterations as f64);
            more_iterations += usize::from(warm.iterations > cold.iterations);
            worst_ratio = worst_ratio.max(warm.seconds_total / cold.seconds_total);
        } else {
            println!(",,,,,");
        }
    }
    eprintln!(
        "median warm {} iterations {:.3} s ({} of {changes} converged, {failed} starts failed); median cold {} iterations {:.3} s; worst warm/cold {worst_ratio:.2}; {more_iterations} warm starts took more iterations than cold",
        median(&mut warm_iterations),
        median(&mut warm_seconds),
        warm_seconds.len(),
        median(&mut cold_iterations),
        median(&mut cold_seconds),
    );
    Ok(())
}
