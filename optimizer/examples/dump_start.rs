//! Prints the initial guess of a cold start without muscles as JSON: scaled variables in the order of `Layout`, for
//! solvers outside this crate.
//!
//! `cargo run --release -p gait-optimizer --example dump_start -- [--subject 1|2] [--a5 0.013] [--guess 1]`

use gait_optimizer::{GaitProblem, InitialGuess, Subject};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut subject = 1;
    let mut a5 = 0.0;
    let mut guess: usize = 1;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{argument} needs a value"))?;
        match argument.as_str() {
            "--subject" => subject = value.parse()?,
            "--a5" => a5 = value.parse()?,
            "--guess" => guess = value.parse()?,
            other => return Err(format!("unknown argument {other}").into()),
        }
    }
    let Some(guess) = InitialGuess::numbered(guess) else {
        return Err(format!("--guess: 1 to {}", InitialGuess::MAX_GUESSES).into());
    };
    let mut problem = GaitProblem::new(Subject::builtin(subject)?, false)?;
    problem.bounds.a5 = a5;
    let start = guess.first_point(&problem)?;
    println!("{}", serde_json::json!({ "subject": problem.subject, "bounds": problem.bounds, "start": start }));
    Ok(())
}
