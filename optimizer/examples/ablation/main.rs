//! Ablation of the interior-point solver: every setting and every heuristic switched off, or to another value, one at a
//! time, over the standard problems and random gaits.
//!
//! `cargo run --release -p gait-optimizer --example ablation -- [--cold 12] [--tight 4] [--warm 12] [--muscles off]
//! [--seed 1] [--threads 2] [--variants WORD] [--sets WORD]`: `--cold` random actions of Table I and `--tight` actions
//! far beyond it from one initial guess, and `--warm` random changes of two bounds from the gait of the default bounds,
//! all for subject 1. At most 500 iterations a phase. `--variants` and `--sets` select those whose names contain a word.
//!
//! A row has the problems that a variant solves in a set, its iterations and factorisations and its processor time
//! relative to the default on the same problems, how many objectives are worse and better by more than 1e-6
//! (relative), and on how many problems the result differs in any bit. Sets without a difference are left out. The
//! processor time is that of the same thread directly after the default.

#[path = "../arguments/mod.rs"]
mod arguments;
mod instances;
#[path = "../splitmix/mod.rs"]
mod splitmix;
#[path = "../../nlp/tests/standard_problems/mod.rs"]
mod standard_problems;
mod table;
#[path = "../tuned_actions/mod.rs"]
mod tuned_actions;
mod variants;

use arguments::argument;
use instances::{Instance, Measured};
use std::collections::BTreeMap;
use std::error::Error;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

fn main() -> Result<(), Box<dyn Error>> {
    let mut instances = instances::all(
        argument("--cold", "12").parse()?,
        argument("--tight", "4").parse()?,
        argument("--warm", "12").parse()?,
        argument("--muscles", "off") == "on",
        argument("--seed", "1").parse()?,
    )?;
    let word = argument("--sets", "");
    instances.retain(|instance| instance.set.contains(&word));
    let word = argument("--variants", "");
    let variants: Vec<_> = variants::all().into_iter().filter(|v| v.name.contains(&word)).collect();
    let threads: usize = argument("--threads", "2").parse()?;
    let (next, results) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(instance) = instances.get(index) else { break };
                    let row = measure(instance, &variants);
                    if let Ok(mut results) = results.lock() {
                        results.insert(index, row);
                    }
                }
            });
        }
    });
    let results = results.into_inner().map_err(|_| "a thread panicked")?;
    let rows: Vec<_> = instances.iter().zip(results.into_values()).collect();
    table::print(&variants, &rows);
    Ok(())
}

/// The default, then each variant; `None` where a variant does not concern the problem.
fn measure(instance: &Instance, variants: &[variants::Variant]) -> (Measured, Vec<Option<Measured>>) {
    // The first solve of a thread is slower.
    instance.solve(&|_| {});
    let usual = instance.solve(&|_| {}).unwrap_or_default();
    (usual, variants.iter().map(|variant| instance.solve(&variant.change)).collect())
}
