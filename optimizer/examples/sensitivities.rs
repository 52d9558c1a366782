//! Sensitivities of gaits against central differences of solves with moved bounds.
//!
//! `cargo run --release -p gait-optimizer --example sensitivities -- [--subject 1] [--muscles on] [--gaits 10] [--seed 1]`
//!
//! Default bounds, then random actions of Table I. For every active tuned bound of each gait: the derivatives of objective
//! and Gait RMSE, and the central differences of two warm-started solves that keep the active constraints. A bound without
//! room to move, because a constraint is only just active, is counted. At the end, the share of pairs whose relative error is
//! at most 1e-3. With `--beyond on`, a third solve a tenth beyond the predicted interval tells whether its active constraints
//! differ.

mod arguments;
mod median;
mod splitmix;
mod tuned_actions;

use arguments::argument;
use gait_optimizer::sensitivity::{BoundSensitivity, GaitSensitivities, sensitivities};
use gait_optimizer::{
    CancelToken, GaitProblem, SolveOptions, SolveOutcome, SolveStatus, Subject, TunedBounds, WarmStart, solve,
};
use median::median;
use splitmix::SplitMix;
use std::error::Error;
use tuned_actions::LEVELS;

/// Largest relative error of a pair that agrees.
const AGREES: f64 = 1e-3;
/// Smallest room to move in each direction, relative to the value of the bound.
const MIN_ROOM: f64 = 1e-6;

/// Tight, and without tightening between nodes, so that solves differ in the moved bound alone.
fn options() -> SolveOptions {
    SolveOptions { tolerance: 1e-9, tightening_rounds: 0, ..SolveOptions::default() }
}

fn run(problem: &GaitProblem, warm: Option<&WarmStart>) -> Result<SolveOutcome, Box<dyn Error>> {
    Ok(solve(problem, warm, &options(), &mut |_| {}, &CancelToken::new())?)
}

fn random_bounds(random: &mut SplitMix) -> TunedBounds {
    loop {
        let action = LEVELS.map(|levels| levels[random.below(levels.len())]);
        if let Ok(bounds) = TunedBounds::from_array(action) {
            return bounds;
        }
    }
}

/// The gait with a bound at another value; `None` if that value is not allowed or the solve does not converge.
fn moved(base: &GaitProblem, bound: usize, to: f64, from: &WarmStart) -> Result<Option<SolveOutcome>, Box<dyn Error>> {
    let mut action = base.bounds.to_array();
    action[bound] = to;
    let Ok(bounds) = TunedBounds::from_array(action) else { return Ok(None) };
    let outcome = run(&GaitProblem { bounds, ..base.clone() }, Some(from))?;
    Ok((outcome.report.status == SolveStatus::Converged).then_some(outcome))
}

/// A step that keeps the active constraints in both directions.
fn step(bound: &BoundSensitivity) -> f64 {
    let (low, high) = bound.interval;
    let room = [low.map(|low| bound.value - low), high.map(|high| high - bound.value)];
    let room = room.into_iter().flatten().fold(f64::INFINITY, f64::min);
    (0.3 * room).min(1e-4 * bound.value.abs().max(1e-2))
}

/// The places of the active constraints of every bound.
fn places(found: &GaitSensitivities) -> Vec<String> {
    let mut places: Vec<String> =
        found.bounds.iter().flat_map(|bound| bound.active.iter().map(|active| active.place.clone())).collect();
    places.sort();
    places
}

fn main() -> Result<(), Box<dyn Error>> {
    let subject: u32 = argument("--subject", "1").parse()?;
    let muscles = argument("--muscles", "on") == "on";
    let gaits: usize = argument("--gaits", "10").parse()?;
    let beyond = argument("--beyond", "off") == "on";
    let mut random = SplitMix(argument("--seed", "1").parse()?);
    let mut base = GaitProblem::new(Subject::builtin(subject)?, muscles)?;
    println!("gait,bound,value,step,objective,objective_by_solves,rmse,rmse_by_solves,error");
    let (mut errors, mut without_room, mut unsolved) = (Vec::new(), 0, 0);
    let (mut same_within, mut within, mut differ_beyond, mut beyonds) = (0, 0, 0, 0);
    for gait in 0..gaits {
        if gait > 0 {
            base.bounds = random_bounds(&mut random);
        }
        let start = run(&base, None)?;
        if start.report.status != SolveStatus::Converged {
            eprintln!("gait {gait}: {:?}", start.report.status);
            continue;
        }
        let found = match sensitivities(&base, &start.warm_start, &options()) {
            Ok(found) => found,
            Err(error) => {
                eprintln!("gait {gait}: {error}");
                continue;
            }
        };
        for (place, bound) in found.bounds.iter().enumerate().filter(|(_, bound)| !bound.active.is_empty()) {
            let step = step(bound);
            if step < MIN_ROOM * bound.value.abs().max(1e-2) {
                without_room += 1;
                continue;
            }
            let at = |to: f64| moved(&base, place, to, &start.warm_start);
            let (Some(more), Some(less)) = (at(bound.value + step)?, at(bound.value - step)?) else {
                unsolved += 1;
                continue;
            };
            let rate = |more: f64, less: f64| (more - less) / (2.0 * step);
            let objective = rate(more.report.objective, less.report.objective);
            let rmse = rate(more.report.gait_rmse_rad, less.report.gait_rmse_rad);
            let error = |derivative: f64, expected: f64| (derivative - expected).abs() / expected.abs();
            let worst = error(bound.derivatives.objective, objective).max(error(bound.derivatives.gait_rmse_rad, rmse));
            errors.push(worst);
            println!(
                "{gait},{},{},{step:.2e},{:.6e},{objective:.6e},{:.6e},{rmse:.6e},{worst:.1e}",
                bound.bound, bound.value, bound.derivatives.objective, bound.derivatives.gait_rmse_rad
            );
            if !beyond {
                continue;
            }
            let active_at = |to: f64| -> Result<Option<Vec<String>>, Box<dyn Error>> {
                let Some(outcome) = at(to)? else { return Ok(None) };
                let mut there = base.clone();
                let mut action = base.bounds.to_array();
                action[place] = to;
                there.bounds = TunedBounds::from_array(action)?;
                Ok(sensitivities(&there, &outcome.warm_start, &options()).ok().map(|found| places(&found)))
            };
            let known = places(&found);
            if let Some(high) = bound.interval.1 {
                if let Some(inside) = active_at(bound.value + 0.9 * (high - bound.value))? {
                    within += 1;
                    same_within += usize::from(inside == known);
                }
                if let Some(outside) = active_at(bound.value + 1.1 * (high - bound.value))? {
                    beyonds += 1;
                    differ_beyond += usize::from(outside != known);
                }
            }
        }
    }
    let agree = errors.iter().filter(|error| **error <= AGREES).count();
    eprintln!(
        "pairs {}, relative error at most {AGREES}: {agree}, median {:.1e}; without room {without_room}, unsolved {unsolved}",
        errors.len(),
        median(&mut errors)
    );
    if beyond {
        eprintln!(
            "active constraints the same at 0.9 of the interval: {same_within} of {within}; other ones at 1.1: {differ_beyond} of {beyonds}"
        );
    }
    Ok(())
}
