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
    let clock = Instant::now();
    for (set, cases) in standard_problems::sets::all() {
        let (mut solved, mut count, mut iterations, mut misses) = (0, 0, 0, Vec::new());
        println!("{:18} {:>16} {:>5} {:>5} {:>9}  status", set, "objective", "it", "fact", "ms");
        for case in cases.iter().filter(|case| filter.as_ref().is_none_or(|name| case.name == *name)) {
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
            let start = StartPoint::Cold(case.start.clone());
            match solve(case.program.as_ref(), &start, &NlpSettings::default(), &mut show, &|| false) {
                Ok(r) => {
                    let good = r.status == NlpStatus::Converged && case.is_optimum(r.objective);
                    let note = match (good, r.status) {
                        (true, _) => "",
                        (false, NlpStatus::Converged) => "  <- another local optimum",
                        _ => "  <- MISS",
                    };
                    println!(
                        "{:18} {:16.8e} {:5} {:5} {:9.3}  {:?}{note}",
                        case.name,
                        r.objective,
                        r.iterations,
                        r.counts.factorisations,
                        1e3 * r.timing.total,
                        r.status
                    );
                    iterations += r.iterations;
                    if good { solved += 1 } else { misses.push(case.name.as_str()) }
                }
                Err(error) => {
                    println!("{:18} {error}", case.name);
                    misses.push(&case.name);
                }
            }
        }
        let misses = if misses.is_empty() { "none".to_owned() } else { misses.join(", ") };
        println!("{set}: solved {solved} of {count}, {iterations} iterations; misses: {misses}");
    }
    println!("{:.3} s", clock.elapsed().as_secs_f64());
}
