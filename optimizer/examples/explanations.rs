//! Explanations of bounds without a gait, each checked by solving with what it names.
//!
//! `cargo run --release -p gait-optimizer --example explanations -- [--subject 1] [--muscles off] [--actions 10] [--seed 1]
//! [--threads 1]`: draws bounds far tighter than Table I, two at a time, until so many have no gait; explains each, then
//! solves with every relaxation that is said to help (it has to converge, every constraint met) and prints one line per
//! relaxation. Ends with an error when one does not hold.

mod arguments;
mod splitmix;

use arguments::argument;
use gait_optimizer::explanation::explain;
use gait_optimizer::{
    CancelToken, GaitProblem, SolveOptions, SolveOutcome, SolveStatus, Subject, TunedBounds, WarmStart, solve,
};
use splitmix::SplitMix;
use std::error::Error;

/// Values beyond Table I (Li et al. 2022), by bound.
const TIGHT: [&[f64]; 8] = [
    &[2.0, 3.0, 4.0],
    &[10.0, 20.0, 30.0],
    &[1.5, 2.0],
    &[0.35, 0.5],
    &[0.15, 0.2, 0.3],
    &[0.0, 0.02],
    &[5.0, 10.0],
    &[5.0, 8.0],
];

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
    println!("action,status,worst_violation,where,bound,from,to,not_with,check_status,check_violation");
    let (mut drawn, mut explained, mut wrong) = (0, 0, 0);
    while explained < actions {
        let mut bounds = TunedBounds::default();
        for _ in 0..2 {
            let bound = random.below(8);
            bounds.set(TunedBounds::NAMES[bound], TIGHT[bound][random.below(TIGHT[bound].len())])?;
        }
        if bounds.validate().is_err() {
            continue;
        }
        drawn += 1;
        let problem = GaitProblem { bounds, ..base.clone() };
        let outcome = run(&problem, None)?;
        let report = &outcome.report;
        eprintln!("{bounds:?}: {:?}, {} iterations, {:.0} s", report.status, report.iterations, report.seconds_total);
        let Some(explanation) = explain(&problem, (&outcome).into(), &options, &mut |_| {}, &CancelToken::new())?
        else {
            continue;
        };
        explained += 1;
        let given = bounds.to_array().into_iter().zip(TunedBounds::default().to_array());
        let tightened = TunedBounds::NAMES.iter().zip(given).filter(|(_, (own, usual))| own != usual);
        let action = tightened.map(|(name, (own, _))| format!("{name}={own}")).collect::<Vec<_>>().join(" ");
        let worst = explanation.violations.first();
        let place = worst.map_or(String::new(), |v| format!("{:.2e} {},{}", v.amount, v.unit, v.row));
        let status = format!("{:?}", explanation.status);
        if explanation.relaxations.is_empty() {
            println!("{action},{status},{place},none,,,,,");
        }
        for relaxation in &explanation.relaxations {
            print!("{action},{status},{place},{},{}", relaxation.bound, relaxation.from);
            let Some(to) = relaxation.to else {
                println!(",,{},,", relaxation.not_with);
                continue;
            };
            let mut relaxed = problem.clone();
            relaxed.bounds.set(&relaxation.bound, to)?;
            let check = run(&relaxed, relaxation.warm_start.as_ref())?.report;
            wrong += usize::from(check.status != SolveStatus::Converged);
            println!(",{to},{},{:?},{:.1e}", relaxation.not_with, check.status, check.max_violation);
        }
    }
    eprintln!("{explained} of {drawn} drawn have no gait; {wrong} relaxations do not hold");
    if wrong > 0 { Err("an explanation names a relaxation with which no gait converges".into()) } else { Ok(()) }
}
