//! Whether the gait of an action depends on the way to it: continuation against warm starts.
//!
//! `cargo run --release -p gait-optimizer --example continuation -- [--subject 1] [--muscles on] [--actions 20] [--seed 1]
//! [--threads 1]` solves the root with default bounds. Then it computes the gait of random actions of Table I in five ways:
//! continued from the root, continued from the root by way of an action that has half of the bounds, continued from the gait
//! of the previous action, and warm-started (`solve`) from the root and from the gait of the previous action. It prints one
//! CSV row for each, with the differences from the first way. At the end, for each way: the share of actions with the same
//! gait, that is, with objectives that differ by at most 1e-6 relative and Gait RMSE by at most 1e-3 rad, among all
//! actions and among those where neither path has a fold.

mod arguments;
mod median;
mod splitmix;
mod tuned_actions;

use arguments::argument;
use gait_optimizer::{
    CancelToken, FollowedPath, GaitProblem, Root, SolveOptions, SolveOutcome, SolveStatus, Subject, TunedBounds, solve,
    solve_by_continuation,
};
use median::median;
use splitmix::SplitMix;
use std::error::Error;
use tuned_actions::LEVELS;

const SAME_OBJECTIVE: f64 = 1e-6;
const SAME_RMSE_RAD: f64 = 1e-3;
/// The ways after the first.
const OTHER_WAYS: [&str; 4] = [
    "continued by way of another action",
    "continued from the previous gait",
    "warm from the root",
    "warm from the previous gait",
];

/// A gait and how it was reached.
struct Reached {
    outcome: SolveOutcome,
    path: Option<FollowedPath>,
}

impl Reached {
    fn converged(&self) -> bool {
        self.outcome.report.status == SolveStatus::Converged
    }

    fn has_fold(&self) -> bool {
        self.path.is_some_and(|path| path.fold.is_some())
    }

    fn root(&self, bounds: TunedBounds) -> Root {
        Root { bounds, solution: self.outcome.warm_start.clone() }
    }
}

/// How often a way gives the gait of the first way.
#[derive(Default)]
struct Tally {
    all: usize,
    same: usize,
    without_fold: usize,
    same_without_fold: usize,
    iterations: Vec<f64>,
    rmse_differences: Vec<f64>,
}

fn random_bounds(random: &mut SplitMix) -> TunedBounds {
    loop {
        let action = LEVELS.map(|levels| levels[random.below(levels.len())]);
        if let Ok(bounds) = TunedBounds::from_array(action) {
            return bounds;
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let subject: u32 = argument("--subject", "1").parse()?;
    let muscles = argument("--muscles", "on") == "on";
    let actions: usize = argument("--actions", "20").parse()?;
    let mut random = SplitMix(argument("--seed", "1").parse()?);
    let options = SolveOptions { threads: argument("--threads", "1").parse()?, ..SolveOptions::default() };
    let base = GaitProblem::new(Subject::builtin(subject)?, muscles)?;
    let start = solve(&base, None, &options, &mut |_| {}, &CancelToken::new())?;
    let root = Root { bounds: base.bounds, solution: start.warm_start };
    let continued = |bounds: TunedBounds, root: &Root| -> Result<Reached, Box<dyn Error>> {
        let problem = GaitProblem { bounds, ..base.clone() };
        let (outcome, path) = solve_by_continuation(&problem, root, &options, &mut |_| {}, &CancelToken::new())?;
        Ok(Reached { outcome, path: Some(path) })
    };
    let warm = |bounds: TunedBounds, root: &Root| -> Result<Reached, Box<dyn Error>> {
        let problem = GaitProblem { bounds, ..base.clone() };
        let outcome = solve(&problem, Some(&root.solution), &options, &mut |_| {}, &CancelToken::new())?;
        Ok(Reached { outcome, path: None })
    };
    let mut previous = Root { bounds: root.bounds, solution: root.solution.clone() };
    let mut first_iterations = Vec::new();
    let mut folds = 0;
    let mut tallies: [Tally; 4] = Default::default();
    println!(
        "action,way,status,iterations,seconds,steps,refused_steps,fold,objective,gait_rmse_rad,objective_difference,rmse_difference"
    );
    for _ in 0..actions {
        let bounds = random_bounds(&mut random);
        let mut half = root.bounds.to_array();
        half[..TunedBounds::COUNT / 2].copy_from_slice(&bounds.to_array()[..TunedBounds::COUNT / 2]);
        let half = TunedBounds::from_array(half)?;
        let first = continued(bounds, &root)?;
        let way = continued(half, &root)?;
        let others = [
            way.converged().then(|| continued(bounds, &way.root(half))).transpose()?,
            Some(continued(bounds, &previous)?),
            Some(warm(bounds, &root)?),
            Some(warm(bounds, &previous)?),
        ];
        print_row(bounds, "continued from the root", &first, None);
        first_iterations.push(first.outcome.report.iterations as f64);
        folds += usize::from(first.has_fold());
        for ((other, name), tally) in others.iter().zip(OTHER_WAYS).zip(&mut tallies) {
            let Some(other) = other else { continue };
            print_row(bounds, name, other, Some(&first));
            tally.iterations.push(other.outcome.report.iterations as f64);
            if !(first.converged() && other.converged()) {
                continue;
            }
            let (objective, rmse) = differences(other, &first);
            let same = usize::from(objective.abs() <= SAME_OBJECTIVE && rmse.abs() <= SAME_RMSE_RAD);
            tally.all += 1;
            tally.same += same;
            tally.rmse_differences.push(rmse.abs());
            let way_has_fold = name == OTHER_WAYS[0] && way.has_fold();
            if !(first.has_fold() || other.has_fold() || way_has_fold) {
                tally.without_fold += 1;
                tally.same_without_fold += same;
            }
        }
        if first.converged() {
            previous = first.root(bounds);
        }
    }
    eprintln!(
        "continued from the root: median {} iterations, {folds} of {actions} with a fold",
        median(&mut first_iterations)
    );
    for (name, tally) in OTHER_WAYS.iter().zip(&mut tallies) {
        eprintln!(
            "{name}: same gait {} of {}, without fold {} of {}; median RMSE difference {:.4} rad; median {} iterations",
            tally.same,
            tally.all,
            tally.same_without_fold,
            tally.without_fold,
            median(&mut tally.rmse_differences),
            median(&mut tally.iterations)
        );
    }
    Ok(())
}

/// Differences of objective (relative) and Gait RMSE, rad.
fn differences(one: &Reached, other: &Reached) -> (f64, f64) {
    let (one, other) = (&one.outcome.report, &other.outcome.report);
    ((one.objective - other.objective) / other.objective.abs(), one.gait_rmse_rad - other.gait_rmse_rad)
}

fn print_row(bounds: TunedBounds, way: &str, reached: &Reached, first: Option<&Reached>) {
    let report = &reached.outcome.report;
    let action: Vec<String> = bounds.to_array().iter().map(f64::to_string).collect();
    let path = reached.path.map_or(",,".to_owned(), |path| {
        let fold = path.fold.map_or("none".to_owned(), |fold| format!("{:?} at {:.4}", fold.reason, fold.share));
        format!("{},{},{fold}", path.steps, path.refused_steps)
    });
    let difference = first.map_or(",".to_owned(), |first| {
        let (objective, rmse) = differences(reached, first);
        format!("{objective:.2e},{rmse:.2e}")
    });
    println!(
        "{},{way},{:?},{},{:.2},{path},{:.8},{:.4},{difference}",
        action.join(" "),
        report.status,
        report.iterations,
        report.seconds_total,
        report.objective,
        report.gait_rmse_rad
    );
}
