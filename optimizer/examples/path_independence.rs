//! Does the gait of an action depend on where its solve started?
//!
//! `cargo run --release -p gait-optimizer --example path_independence -- [--subject 1] [--muscles on] [--actions 20]
//! [--others 5] [--trials 30] [--seed 1] [--minutes 40]`
//!
//! Solves random actions of Table I with warm starts: from the root, which is the gait of the default bounds; from the gaits
//! of `--others` random actions, themselves solved from the root; and from the incumbent of a chain of `--trials` random
//! actions, each started from the gait with the lowest Gait RMSE so far, as in a study. Two gaits are the same if their
//! objectives differ by at most 1e-6 (relative) and their Gait RMSE by 1e-3 rad. One CSV row for each action, and shares and
//! reasons at the end. Stops after `--minutes`.

mod arguments;
mod splitmix;
mod tuned_actions;

use arguments::argument;
use gait_optimizer::{
    CancelToken, GaitProblem, SolveOptions, SolveOutcome, SolveStatus, StartedFrom, Subject, TunedBounds, WarmStart,
    solve,
};
use splitmix::SplitMix;
use std::collections::BTreeMap;
use std::error::Error;
use std::time::{Duration, Instant};
use tuned_actions::LEVELS;

/// Largest differences of the same gait.
const SAME_OBJECTIVE: f64 = 1e-6;
const SAME_RMSE_RAD: f64 = 1e-3;
/// Largest relative difference of the objectives of one local optimum that was solved to another accuracy.
const NEAR_OBJECTIVE: f64 = 1e-4;

type Outcome = Result<SolveOutcome, Box<dyn Error>>;

fn from_gait(problem: &GaitProblem, warm: Option<&WarmStart>) -> Outcome {
    let options = SolveOptions::default();
    Ok(solve(problem, warm, &options, &mut |_| {}, &CancelToken::new())?)
}

fn random_bounds(random: &mut SplitMix) -> TunedBounds {
    loop {
        let action = LEVELS.map(|levels| levels[random.below(levels.len())]);
        if let Ok(bounds) = TunedBounds::from_array(action) {
            return bounds;
        }
    }
}

/// How the gait of another start differs from that of the root.
fn difference(root: &SolveOutcome, other: &SolveOutcome) -> &'static str {
    let (a, b) = (&root.report, &other.report);
    let objective = (a.objective - b.objective).abs() / a.objective.abs();
    let rmse = (a.gait_rmse_rad - b.gait_rmse_rad).abs();
    match (a.status == SolveStatus::Converged, b.status == SolveStatus::Converged) {
        (true, true) if objective <= SAME_OBJECTIVE && rmse <= SAME_RMSE_RAD => "same",
        (true, true)
            if a.started_from == StartedFrom::ColdAfterWarm || b.started_from == StartedFrom::ColdAfterWarm =>
        {
            "a cold start replaced a warm start"
        }
        (true, true)
            if a.tightened_bounds != b.tightened_bounds && objective <= NEAR_OBJECTIVE && rmse <= SAME_RMSE_RAD =>
        {
            "the same local optimum with other bounds tightened"
        }
        (true, true) if objective <= NEAR_OBJECTIVE && rmse <= SAME_RMSE_RAD => "almost the same",
        (true, true) => "another local optimum",
        (false, false) => "same",
        _ => "one start found no gait",
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let subject: u32 = argument("--subject", "1").parse()?;
    let muscles = argument("--muscles", "on") == "on";
    let actions: usize = argument("--actions", "20").parse()?;
    let others: usize = argument("--others", "5").parse()?;
    let trials: usize = argument("--trials", "30").parse()?;
    let limit = Duration::from_secs(60 * argument("--minutes", "40").parse::<u64>()?);
    let mut random = SplitMix(argument("--seed", "1").parse()?);
    let begun = Instant::now();
    let base = GaitProblem::new(Subject::builtin(subject)?, muscles)?;
    let at = |bounds: TunedBounds| GaitProblem { bounds, ..base.clone() };
    let root = from_gait(&base, None)?.warm_start;
    let mut starts = Vec::new();
    while starts.len() < others {
        let problem = at(random_bounds(&mut random));
        let found = from_gait(&problem, Some(&root))?;
        if found.report.status == SolveStatus::Converged {
            starts.push((format!("gait {}", starts.len() + 1), found.warm_start));
        }
    }
    let (mut incumbent, mut lowest) = (root.clone(), f64::INFINITY);
    for _ in 0..trials {
        let problem = at(random_bounds(&mut random));
        let found = from_gait(&problem, Some(&incumbent))?;
        if found.report.status == SolveStatus::Converged && found.report.gait_rmse_rad < lowest {
            lowest = found.report.gait_rmse_rad;
            incumbent = found.warm_start;
        }
    }
    if trials > 0 {
        starts.push((format!("study of {trials} trials"), incumbent));
    }
    println!("action,start,objective,gait_rmse_rad,iterations,against_root");
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    let (mut same_actions, mut done, mut iterations) = (0, 0, 0);
    for number in 1..=actions {
        if begun.elapsed() >= limit {
            break;
        }
        let problem = at(random_bounds(&mut random));
        let own = from_gait(&problem, Some(&root))?;
        let row = |start: &str, outcome: &SolveOutcome, says: &str| {
            let report = &outcome.report;
            println!(
                "{number},{start},{:.8},{:.5},{},{says}",
                report.objective, report.gait_rmse_rad, report.iterations
            );
        };
        row("root", &own, "");
        iterations += own.report.iterations;
        let mut all = true;
        for (name, start) in &starts {
            let found = from_gait(&problem, Some(start))?;
            let says = difference(&own, &found);
            row(name, &found, says);
            *reasons.entry(says).or_default() += 1;
            all &= says == "same";
            iterations += found.report.iterations;
        }
        done += 1;
        same_actions += usize::from(all);
    }
    let pairs: usize = reasons.values().sum();
    eprintln!("{done} actions, {iterations} iterations: {same_actions} with the same gait from every start");
    for (reason, count) in reasons {
        eprintln!("{reason}: {count} of {pairs} starts");
    }
    Ok(())
}
