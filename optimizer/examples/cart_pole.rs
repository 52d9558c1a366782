//! The swing-up of a cart-pole, a standard problem with published times: ours beside them.
//!
//! `cargo run --release -p gait-optimizer --example cart_pole -- [--intervals 100,150,200,250,300] [--threads 1]`: CSV, one row
//! a size. The problem is that of Sleipnir's benchmarks (github.com/SleipnirGroup/Sleipnir, `benchmarks/scalability/cart_pole`,
//! with times of Sleipnir and of CasADi + IPOPT in `benchmarks/cart-pole-scalability-results-*.csv`): 5 s in steps of the
//! classical Runge-Kutta method, least sum of squared forces. `benches/casadi/cart_pole.py` runs IPOPT beside it.

mod arguments;
#[path = "../tests/nlp_standard/mod.rs"]
mod nlp_standard;

use arguments::argument;
use gait_optimizer::nlp::{NlpSettings, NonlinearProgram, StartPoint, solve};
use nlp_standard::swing_up::SwingUp;
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let threads = argument("--threads", "1").parse()?;
    println!("intervals,variables,rows,status,iterations,objective,violation,seconds,seconds_evaluation");
    for intervals in argument("--intervals", "100,150,200,250,300").split(',') {
        let problem = SwingUp::new(intervals.parse()?);
        let started = Instant::now();
        let settings = NlpSettings { threads, ..NlpSettings::default() };
        let result = solve(&problem, &StartPoint::Cold(problem.start()), &settings, &mut |_| {}, &|| false)?;
        let seconds = started.elapsed().as_secs_f64();
        let mut values = vec![0.0; problem.rows()];
        problem.constraints(&result.x, &mut values);
        let violation = values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        println!(
            "{intervals},{},{},{:?},{},{:.6},{violation:.1e},{seconds:.4},{:.4}",
            problem.variables(),
            problem.rows(),
            result.status,
            result.iterations,
            result.objective,
            result.timing.evaluation
        );
    }
    Ok(())
}
