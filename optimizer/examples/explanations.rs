//! Infeasibility explanations, each checked by solves with the relaxations that it names.
//!
//! `cargo run --release -p gait-optimizer --example explanations -- [--subject 1] [--muscles off] [--actions 10]
//! [--seed 1] [--threads 1] [--bounds "a4=0.5,a7=5;a2=10"]` explains the given bounds, or draws pairs of bounds far
//! tighter than Table I until `--actions` of them have no gait. Then it solves with every relaxation that should give a
//! gait, and prints one line for each. It fails if a solve does not converge.

mod arguments;
mod splitmix;
mod tuned_actions;

use arguments::argument;
use gait_optimizer::explanation::{Explanation, RelaxedBound, explain};
use gait_optimizer::{
    CancelToken, GaitProblem, SolveOptions, SolveOutcome, SolveStatus, Subject, TunedBounds, WarmStart, solve,
};
use splitmix::SplitMix;
use std::error::Error;
use tuned_actions::TIGHT;

fn main() -> Result<(), Box<dyn Error>> {
    let muscles = argument("--muscles", "off") == "on";
    let actions: usize = argument("--actions", "10").parse()?;
    let mut random = SplitMix(argument("--seed", "1").parse()?);
    let base = GaitProblem::new(Subject::builtin(argument("--subject", "1").parse()?)?, muscles)?;
    let options =
        SolveOptions { threads: argument("--threads", "1").parse()?, retry: false, ..SolveOptions::default() };
    let run = |problem: &GaitProblem, warm: Option<&WarmStart>| -> Result<SolveOutcome, Box<dyn Error>> {
        Ok(solve(problem, warm, &options, &mut |_| {}, &CancelToken::new())?)
    };
    println!("action,conflict,missed,where,relaxed,to,not_with,undecided,starts,solves,check_status,check_violation");
    let (mut drawn, mut explained, mut wrong) = (0, 0, 0);
    let given = argument("--bounds", "");
    let mut given = given.split(';').filter(|bounds| !bounds.is_empty());
    let only_given = given.clone().next().is_some();
    while only_given || explained < actions {
        let bounds = match given.next() {
            Some(bounds) => TunedBounds::parse(bounds)?,
            None if only_given => break,
            None => drawn_bounds(&mut random)?,
        };
        if bounds.validate().is_err() {
            continue;
        }
        drawn += 1;
        let problem = GaitProblem { bounds, ..base.clone() };
        let outcome = run(&problem, None)?;
        let report = &outcome.report;
        eprintln!("{bounds:?}: {:?}, {} iterations, {:.0} s", report.status, report.iterations, report.seconds_total);
        let begun = std::time::Instant::now();
        let Some(explanation) = explain(&problem, (&outcome).into(), &options, &mut |_| {}, &CancelToken::new())?
        else {
            continue;
        };
        explained += 1;
        eprintln!("    explained in {:.0} s", begun.elapsed().as_secs_f64());
        for sentence in explanation.sentences() {
            eprintln!("    {sentence}");
        }
        let given = bounds.to_array().into_iter().zip(TunedBounds::default().to_array());
        let tightened = TunedBounds::NAMES.iter().zip(given).filter(|(_, (own, usual))| own != usual);
        let action = tightened.map(|(name, (own, _))| format!("{name}={own}")).collect::<Vec<_>>().join(" ");
        wrong += print(&problem, &action, &explanation, &options)?;
    }
    eprintln!("{explained} of {drawn} draws have no gait; {wrong} relaxations give no gait");
    if wrong > 0 { Err("an explanation names a relaxation with which no gait converges".into()) } else { Ok(()) }
}

/// Two bounds far tighter than usual, or one.
fn drawn_bounds(random: &mut SplitMix) -> Result<TunedBounds, Box<dyn Error>> {
    let mut bounds = TunedBounds::default();
    for _ in 0..2 {
        let bound = random.below(TunedBounds::COUNT);
        bounds.set(TunedBounds::NAMES[bound], TIGHT[bound][random.below(TIGHT[bound].len())])?;
    }
    Ok(bounds)
}

/// Solves with each relaxation that should give a gait, and prints a line for each. Returns how many do not converge.
fn print(
    problem: &GaitProblem,
    action: &str,
    explanation: &Explanation,
    options: &SolveOptions,
) -> Result<usize, Box<dyn Error>> {
    let conflicts = explanation.conflicts.iter().map(|conflict| {
        let names: Vec<&str> = conflict.bounds.iter().map(|bound| bound.bound.as_str()).collect();
        if names.is_empty() { "fixed constraints".to_owned() } else { names.join(" ") }
    });
    let conflict = if explanation.gait_found { "none".to_owned() } else { conflicts.collect::<Vec<_>>().join(" | ") };
    let worst = explanation.conflicts.first().and_then(|conflict| conflict.violations.first());
    let place = worst.map_or(",".to_owned(), |v| format!("{:.2e} {},{:?}", v.amount, v.unit, v.row));
    let begin = format!("{action},{conflict},{place}");
    let mut lines = Vec::new();
    for one in &explanation.relaxations {
        let to = one.to.map(|to| vec![(one.bound.clone(), to)]);
        let not_with = format!("{}={}", one.bound, one.not_with);
        lines.push((one.bound.clone(), to, not_with, one.undecided, one.starts, one.solves, &one.warm_start));
    }
    for joint in &explanation.together {
        let list =
            |value: &dyn Fn(&RelaxedBound) -> String| joint.bounds.iter().map(value).collect::<Vec<_>>().join(" ");
        let to = joint.bounds.iter().map(|one| Some((one.bound.clone(), one.to?))).collect();
        let not_with = list(&|one| format!("{}={}", one.bound, one.not_with));
        let names = list(&|one| one.bound.clone());
        lines.push((names, to, not_with, joint.undecided, joint.starts, joint.solves, &joint.warm_start));
    }
    if lines.is_empty() {
        println!("{begin},none,,,,,,,");
    }
    let mut wrong = 0;
    for (names, to, not_with, undecided, starts, solves, warm_start) in lines {
        let Some(to) = to else {
            println!("{begin},{names},,{not_with},{undecided},{starts},{solves},,");
            continue;
        };
        let mut relaxed = problem.clone();
        for (bound, value) in &to {
            relaxed.bounds.set(bound, *value)?;
        }
        let check = solve(&relaxed, warm_start.as_ref(), options, &mut |_| {}, &CancelToken::new())?.report;
        wrong += usize::from(check.status != SolveStatus::Converged);
        let to = to.iter().map(|(bound, value)| format!("{bound}={value}")).collect::<Vec<_>>().join(" ");
        let (status, violation) = (check.status, check.max_violation);
        println!("{begin},{names},{to},{not_with},{undecided},{starts},{solves},{status:?},{violation:.1e}");
    }
    Ok(wrong)
}
