//! One cold start of the reference problem from one initial guess, with its results as JSON, for
//! `benches/casadi/race.py`.
//!
//! `cargo run --release -p gait-optimizer --example timed_solve -- [--subject 1|2] [--muscles] [--threads 1] [--guess
//! 1] [--mesh 4,4,6,6] [--bounds a4=0.5,a7=5] [--solver '{"bound_push": 0.01}'] [--trace]`. `--trace` prints every
//! iteration to stderr. `report` has the measured parts of the time, `seconds_other` the rest (initial guess, line
//! search, barrier update). `peak_resident_mb` is the peak memory of the process.

mod peak_memory;

use gait_optimizer::{
    CancelToken, GaitProblem, GaitSettings, InitialGuess, Mesh, SolveOptions, Subject, TunedBounds, solve_from_guesses,
};
use peak_memory::peak_resident_mb;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut subject = 1;
    let mut muscles = false;
    let mut trace = false;
    let mut settings = GaitSettings::reference_problem();
    let mut options = SolveOptions::default();
    let mut guess: usize = 1;
    let mut bounds = TunedBounds::default();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--muscles" => muscles = true,
            "--trace" => trace = true,
            "--subject" => subject = value()?.parse()?,
            "--guess" => guess = value()?.parse()?,
            "--mesh" => {
                let intervals: Vec<usize> = value()?.split(',').map(str::parse).collect::<Result<_, _>>()?;
                let [ds2, ds3, ss2, ss1] = intervals[..] else { return Err("--mesh needs four numbers".into()) };
                settings.mesh = Mesh { ds2, ds3, ss2, ss1 };
            }
            "--solver" => {
                let solver: serde_json::Value = serde_json::from_str(&value()?)?;
                options.solver =
                    serde_json::from_value::<SolveOptions>(serde_json::json!({ "solver": solver }))?.solver;
            }
            "--bounds" => bounds = TunedBounds::parse(&value()?)?,
            "--threads" => options.threads = value()?.parse()?,
            other => return Err(format!("unknown argument {other}").into()),
        }
    }
    let problem = GaitProblem { settings, bounds, ..GaitProblem::new(Subject::builtin(subject)?, muscles)? };
    let mut phases: Vec<(serde_json::Value, usize)> = Vec::new();
    let Some(guess) = InitialGuess::numbered(guess) else {
        return Err(format!("--guess: 1 to {}", InitialGuess::MAX_GUESSES).into());
    };
    let outcome = solve_from_guesses(
        &problem,
        std::slice::from_ref(&guess),
        &options,
        &mut |record| {
            let phase = serde_json::json!(record.phase);
            if trace {
                eprintln!(
                    "{phase} {:4} objective {:.8} violation {:.2e} dual {:.2e} barrier {:.1e} step {:.2e}",
                    record.iteration,
                    record.objective,
                    record.constraint_violation,
                    record.dual_infeasibility,
                    record.barrier,
                    record.step
                );
            }
            match phases.last_mut() {
                Some((name, count)) if *name == phase => *count += 1,
                _ => phases.push((phase, 0)), // The record of the start is not an iteration.
            }
        },
        &CancelToken::new(),
    )?;
    let report = &outcome.report;
    let other = report.seconds_total - report.seconds_evaluation - report.seconds_linear_algebra;
    let memory = peak_resident_mb().map_or_else(|| serde_json::json!("unknown"), |mb| serde_json::json!(mb));
    println!(
        "{}",
        serde_json::json!({
            "report": report, "iterations_by_phase": phases, "seconds_other": other, "peak_resident_mb": memory,
        })
    );
    Ok(())
}
