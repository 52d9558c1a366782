//! Solve times of the swing-up of a cart-pole, for comparison with published ones.
//!
//! `cargo run --release -p interior-point --example cart_pole [intervals,... [threads]]`: CSV, one row for each
//! number of intervals. The problem is that of Sleipnir's benchmarks (github.com/SleipnirGroup/Sleipnir,
//! `benchmarks/scalability/cart_pole`, with times of Sleipnir and of CasADi + IPOPT in
//! `benchmarks/cart-pole-scalability-results-*.csv`): 5 s in steps of the classical Runge-Kutta method, minimal sum of
//! squared forces. `optimizer/benches/casadi/cart_pole.py` compares with IPOPT.

#[path = "../tests/standard_problems/mod.rs"]
mod standard_problems;

use interior_point::{NlpSettings, NonlinearProgram, StartPoint, solve};
use standard_problems::swing_up::SwingUp;
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let intervals = arguments.next().unwrap_or_else(|| "100,150,200,250,300".to_owned());
    let threads = arguments.next().map_or(Ok(1), |threads| threads.parse())?;
    println!("intervals,variables,rows,status,iterations,objective,violation,seconds,seconds_evaluation");
    for intervals in intervals.split(',') {
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
