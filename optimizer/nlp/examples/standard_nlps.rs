//! Solves the standard problems with default settings and prints every result, with unsolved problems by name.
//!
//! `cargo run --release -p interior-point --example standard_nlps [name]`; with a name, every iteration of that
//! problem.

#[path = "../tests/standard_problems/mod.rs"]
mod standard_problems;

use std::time::Instant;

use interior_point::{NlpIteration, NlpSettings, NlpStatus, StartPoint, solve};

fn main() {
    let filter = std::env::args().nth(1);
    let problems = standard_problems::hock_schittkowski::all();
    let (mut solved, mut count, mut iterations, mut misses) = (0, 0, 0, Vec::new());
    let clock = Instant::now();
    println!("{:8} {:>16} {:>5} {:>5} {:>9}  status", "problem", "objective", "it", "fact", "ms");
    for problem in &problems {
        if filter.as_ref().is_some_and(|f| problem.name != f) {
            continue;
        }
        count += 1;
        let mut show = |it: &NlpIteration| {
            if filter.is_some() {
                println!(
                    "{:4} {:?} f={:.8e} viol={:.2e} dual={:.2e} compl={:.2e} mu={:.1e} a={:.1e}/{:.1e} dw={:.1e} dc={:.1e} ls={}",
                    it.number,
                    it.phase,
                    it.objective,
                    it.violation,
                    it.dual_infeasibility,
                    it.complementarity,
                    it.mu,
                    it.alpha_primal,
                    it.alpha_dual,
                    it.delta_w,
                    it.delta_c,
                    it.trials
                );
            }
        };
        let start = StartPoint::Cold(problem.start.clone());
        match solve(problem, &start, &NlpSettings::default(), &mut show, &|| false) {
            Ok(r) => {
                let good = r.status == NlpStatus::Converged && problem.is_optimum(r.objective);
                let note = match (good, r.status) {
                    (true, _) => "",
                    (false, NlpStatus::Converged) => "  <- another local optimum",
                    _ => "  <- MISS",
                };
                println!(
                    "{:8} {:16.8e} {:5} {:5} {:9.3}  {:?}{note}",
                    problem.name,
                    r.objective,
                    r.iterations,
                    r.counts.factorisations,
                    1e3 * r.timing.total,
                    r.status
                );
                iterations += r.iterations;
                if good { solved += 1 } else { misses.push(problem.name) }
            }
            Err(error) => {
                println!("{:8} {error}", problem.name);
                misses.push(problem.name);
            }
        }
    }
    println!("solved {solved} of {count}, {iterations} iterations, {:.3} s", clock.elapsed().as_secs_f64());
    println!("misses: {}", if misses.is_empty() { "none".to_owned() } else { misses.join(", ") });
}
