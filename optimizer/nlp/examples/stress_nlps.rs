//! Solves the standard problems from random starts with several settings, counts each status and checks the residuals
//! of every converged point. Prints the names of problems that did not converge.
//!
//! `cargo run --release -p interior-point --example stress_nlps [starts per problem]`

#[path = "../tests/standard_problems/mod.rs"]
mod standard_problems;

use std::collections::BTreeMap;

use interior_point::{BarrierStrategy, BoundMultiplierStart, NlpSettings, NlpStatus, StartPoint, solve};

fn main() {
    let starts: u64 = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(10);
    let d = NlpSettings::default;
    let variants = [
        ("default", d()),
        ("adaptive", NlpSettings { barrier_strategy: BarrierStrategy::Adaptive, ..d() }),
        (
            "mu 1e-4, centred",
            NlpSettings { mu_initial: 1e-4, bound_multiplier_start: BoundMultiplierStart::Centred, ..d() },
        ),
        ("mu 1e-4, one", NlpSettings { mu_initial: 1e-4, ..d() }),
        ("gradient scaling", NlpSettings { gradient_scaling: Some(100.0), ..d() }),
    ];
    for (label, settings) in &variants {
        let mut tally: BTreeMap<String, usize> = BTreeMap::new();
        let mut others: BTreeMap<String, Vec<&str>> = BTreeMap::new();
        let (mut iterations, mut false_claims) = (0, 0);
        for problem in &standard_problems::hock_schittkowski::all() {
            let mut seed = 12345u64;
            let mut random = || {
                seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
            };
            for _ in 0..starts {
                let x = problem.start.iter().map(|v| v + (1.0 + v.abs()) * random()).collect();
                let what = match solve(problem, &StartPoint::Cold(x), settings, &mut |_| {}, &|| false) {
                    Ok(r) => {
                        iterations += r.iterations;
                        if r.status == NlpStatus::Converged
                            && (r.residuals.violation > 1e-6
                                || r.scaled_residuals.dual_infeasibility > 1e-8
                                || r.scaled_residuals.complementarity > 1e-8)
                        {
                            false_claims += 1;
                        }
                        format!("{:?}", r.status)
                    }
                    Err(error) => error.to_string().chars().take(30).collect(),
                };
                if what != "Converged" {
                    others.entry(what.clone()).or_default().push(problem.name);
                }
                *tally.entry(what).or_default() += 1;
            }
        }
        println!("{label}: {tally:?}, {iterations} iterations, {false_claims} false claims");
        for (what, mut names) in others {
            names.dedup();
            println!("    {what}: {}", names.join(" "));
        }
    }
}
