//! Iterations of the cold starts of `tests/golden.rs` when rounding errors change: each start is perturbed by a relative
//! change of its stride of at most 1e-10.
//!
//! `cargo run --release -p gait-optimizer --example iteration_spread -- [--perturbations 32] [--threads 2] >
//! optimizer/tests/data/iterations.csv`. The limits of the test follow from this file. A change of the solver that moves
//! the distribution comes with a new file.

mod arguments;
#[allow(dead_code)]
mod splitmix;

use arguments::argument;
use gait_optimizer::{
    CancelToken, GaitProblem, GaitSettings, InitialGuess, SolveOptions, SolveReport, Subject, solve_from_guesses,
};
use splitmix::SplitMix;
use std::error::Error;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Largest relative change.
const MAX_CHANGE: f64 = 1e-10;

/// A cold start: subject, muscles, initial guess and number of the perturbation; 0 is the start itself.
type Start = (u32, bool, InitialGuess, usize);

fn main() -> Result<(), Box<dyn Error>> {
    let perturbations: usize = argument("--perturbations", "32").parse()?;
    let threads: usize = argument("--threads", "2").parse()?;
    let mut starts: Vec<Start> = Vec::new();
    for muscles in [false, true] {
        for subject in [1, 2] {
            for guess in [InitialGuess::NATURAL, InitialGuess::EARLY_RISE] {
                starts.extend((0..=perturbations).map(|number| (subject, muscles, guess, number)));
            }
        }
    }
    let next = AtomicUsize::new(0);
    let solved = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(start) = starts.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let report = solve(*start).map_err(|error| error.to_string());
                    if let Ok(mut solved) = solved.lock() {
                        solved.push((*start, report));
                    }
                }
            });
        }
    });
    let mut solved = solved.into_inner().map_err(|_| "a thread panicked")?;
    let place = |start: &Start| starts.iter().position(|other| other == start);
    solved.sort_by_key(|(start, _)| place(start));
    println!("subject,muscles,guess,perturbation,status,iterations");
    for ((subject, muscles, guess, number), report) in solved {
        let report = report?;
        println!("{subject},{muscles},\"{}\",{number},{:?},{}", guess.label(), report.status, report.iterations);
    }
    Ok(())
}

fn solve((subject, muscles, guess, number): Start) -> Result<SolveReport, Box<dyn Error>> {
    let mut random = SplitMix(number as u64);
    let mut factor = || if number == 0 { 1.0 } else { 1.0 + MAX_CHANGE * (random.below(2_000_001) as f64 / 1e6 - 1.0) };
    let guess = InitialGuess {
        stride_time_s: guess.stride_time_s * factor(),
        stride_length_m: guess.stride_length_m * factor(),
        ..guess
    };
    let problem = GaitProblem::new(Subject::builtin(subject)?, muscles)?;
    let problem = GaitProblem { settings: GaitSettings::reference_problem(), ..problem };
    let options = SolveOptions::default();
    Ok(solve_from_guesses(&problem, &[guess], &options, &mut |_| {}, &CancelToken::new())?.report)
}
