//! Time from a cancellation to the end of the solve, at instants spread over the solve.
//!
//! `cargo run --release -p gait-optimizer --example cancel_latency` prints each time and the longest one, in ms.

use gait_optimizer::{CancelToken, GaitProblem, SolveOptions, SolveStatus, Subject, solve};
use std::error::Error;
use std::time::{Duration, Instant};

const INSTANTS: u32 = 20;
const SPACING: Duration = Duration::from_millis(37);

fn main() -> Result<(), Box<dyn Error>> {
    let problem = GaitProblem::new(Subject::builtin(1)?, true)?;
    let options = SolveOptions { initial_guesses: 1, ..SolveOptions::default() };
    let mut longest = Duration::ZERO;
    for instant in 0..INSTANTS {
        let token = CancelToken::new();
        let latency = std::thread::scope(|scope| {
            let solve = scope.spawn(|| {
                let outcome = solve(&problem, None, &options, &mut |_| {}, &token);
                (Instant::now(), outcome.map(|outcome| outcome.report.status))
            });
            std::thread::sleep(SPACING * instant);
            let asked = Instant::now();
            token.cancel();
            solve.join().ok().map(|(ended, status)| (ended.saturating_duration_since(asked), status))
        });
        let Some((latency, status)) = latency else { return Err("the solve panicked".into()) };
        if status? != SolveStatus::Cancelled {
            return Err("the solve ended before it was cancelled".into());
        }
        println!("{:4} ms: {:6.1} ms", (SPACING * instant).as_millis(), 1e3 * latency.as_secs_f64());
        longest = longest.max(latency);
    }
    println!("longest {:.1} ms", 1e3 * longest.as_secs_f64());
    Ok(())
}
