//! Execution of gaits, simulated by a model other than the optimiser's: shares of simulated walks of 20 strides without a fall.
//!
//! `cargo run --release -p gait-optimizer --example execution -- [--simulated-walks 200] [--threads 2] [--training COUNT] [--gaits FILE...]`
//!
//! Rows: the default gait of each subject and variant, the nearest to the reference among those of four initial guesses,
//! the golden gaits, and the gaits of the files. With `--training`, instead the random actions of Table I on
//! which the gains of the controllers were chosen.

#![allow(clippy::unwrap_used)] // the golden gaits are fixtures

mod arguments;
#[path = "../tests/golden_gaits/mod.rs"]
mod golden_gaits;
mod splitmix;
mod tuned_actions;

use arguments::argument;
use gait_optimizer::execution::{ExecutionOptions, SimulatedWalksOnGround, simulate};
use gait_optimizer::{
    CancelToken, Gait, GaitProblem, LocalOptimumChoice, SolveOptions, SolveOutcome, SolveStatus, Subject, TunedBounds,
    solve,
};
use golden_gaits::golden_gait;
use splitmix::SplitMix;
use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicU32;
use std::time::Instant;
use tuned_actions::LEVELS;

/// Subjects and variants.
const VARIANTS: [(u32, bool); 4] = [(1, false), (1, true), (2, false), (2, true)];
/// Seed of the training actions.
const TRAINING_SEED: u64 = 2026;

/// A choice among the gaits of four initial guesses that prefers natural ones.
fn nearest_of_four() -> SolveOptions {
    SolveOptions {
        initial_guesses: 4,
        local_optimum_choice: LocalOptimumChoice::NearestToReference { within_percent: 100.0 },
        ..SolveOptions::default()
    }
}

fn solved(problem: &GaitProblem, options: &SolveOptions) -> Result<Option<Gait>, Box<dyn Error>> {
    let options = SolveOptions { threads: argument("--threads", "2").parse()?, ..*options };
    let outcome = solve(problem, None, &options, &mut |_| {}, &CancelToken::new())?;
    Ok((outcome.report.status == SolveStatus::Converged).then_some(outcome.gait))
}

fn main() -> Result<(), Box<dyn Error>> {
    let grounds = ["level", "+-5 mm", "+-10 mm"].map(|name| format!("{name:36}")).concat();
    let columns = format!("{:36}", "share (95 %)  strides  falls halts").repeat(3);
    println!("gait                     undisturbed  {grounds}pushes, N s   at the limit, %  strides by yield,");
    println!("                         strides      {columns}front  back   knee  ankle     1 2 5 10 20 mm   s");
    let training: usize = argument("--training", "0").parse()?;
    if training > 0 {
        return training_rows(training);
    }
    for (subject, muscles) in VARIANTS {
        let problem = GaitProblem::new(Subject::builtin(subject)?, muscles)?;
        let variant = if muscles { "muscles" } else { "no muscles" };
        for (name, gait) in [
            ("default", solved(&problem, &SolveOptions::default())?),
            ("nearest", solved(&problem, &nearest_of_four())?),
            ("golden", Some(golden_gait(subject, muscles).1)),
        ] {
            row(&format!("{name} {subject} {variant}"), gait.as_ref())?;
        }
    }
    for file in std::env::args().skip_while(|argument| argument != "--gaits").skip(1) {
        let name = Path::new(&file).file_stem().unwrap_or_default().to_string_lossy();
        row(&name, Some(&gait_of_file(&std::fs::read_to_string(&file)?)?))?;
    }
    Ok(())
}

/// The gait of a file of `solve --out`, or a gait downloaded from the service.
fn gait_of_file(text: &str) -> Result<Gait, serde_json::Error> {
    serde_json::from_str(text).or_else(|_| serde_json::from_str::<SolveOutcome>(text).map(|outcome| outcome.gait))
}

/// The first twelve training actions have the gait of a default solve, the others the nearest of four guesses.
fn training_rows(count: usize) -> Result<(), Box<dyn Error>> {
    let mut random = SplitMix(TRAINING_SEED);
    for k in 0..count {
        let action: [f64; TunedBounds::COUNT] = LEVELS.map(|levels| levels[random.below(levels.len())]);
        let (muscles, options) =
            if k < 12 { (k % 4 >= 2, SolveOptions::default()) } else { (k % 4 >= 1, nearest_of_four()) };
        let mut problem = GaitProblem::new(Subject::builtin(if k % 2 == 0 { 1 } else { 2 })?, muscles)?;
        problem.bounds = TunedBounds::from_array(action)?;
        row(&format!("training {k} a5={}", action[4]), solved(&problem, &options)?.as_ref())?;
    }
    Ok(())
}

fn row(name: &str, gait: Option<&Gait>) -> Result<(), Box<dyn Error>> {
    let Some(gait) = gait else {
        println!("{name:25}not converged");
        return Ok(());
    };
    let options = ExecutionOptions {
        number_of_simulated_walks: argument("--simulated-walks", "200").parse()?,
        threads: argument("--threads", "2").parse()?,
        ..ExecutionOptions::default()
    };
    let started = Instant::now();
    let report = simulate(gait, &options, &AtomicU32::new(0), &CancelToken::new())?.ok_or("cancelled")?;
    let grounds: Vec<String> = report.grounds.iter().map(ground).collect();
    let pushes = report.pushes.map_or("-         -".to_owned(), |pushes| {
        format!("{:<6.0} {:<4.0}", pushes.forwards_n_s, pushes.backwards_n_s)
    });
    let level = &report.grounds[0];
    let by_yield: Vec<String> = report.strides_by_yield.iter().map(|walk| walk.strides.to_string()).collect();
    println!(
        "{name:25}{:<13}{}  {pushes:13} {:4.1}  {:4.1}     {:16} {:.1}",
        report.undisturbed_strides,
        grounds.join("  "),
        100.0 * level.knee_saturated_share,
        100.0 * level.ankle_saturated_share,
        by_yield.join(" "),
        started.elapsed().as_secs_f64()
    );
    Ok(())
}

fn ground(ground: &SimulatedWalksOnGround) -> String {
    let [low, high] = ground.completed_share_interval;
    format!(
        "{:.3} ({low:.2}-{high:.2})  {:4.1}     {:4}  {:3}",
        ground.completed_share, ground.mean_strides, ground.fell, ground.halted
    )
}
