//! The table.

use crate::instances::{Instance, Measured};
use crate::variants::Variant;

/// A problem with its default result and that of each variant.
type Row<'a> = (&'a Instance, (Measured, Vec<Option<Measured>>));

/// Relative difference of objectives that counts.
const DIFFERENCE: f64 = 1e-6;

/// Sums over a set.
#[derive(Default)]
struct Sum {
    problems: usize,
    solved: usize,
    iterations: usize,
    factorisations: usize,
    seconds: f64,
    worse: usize,
    better: usize,
    changed: usize,
}

impl Sum {
    fn add(&mut self, own: &Measured, usual: &Measured) {
        self.problems += 1;
        self.solved += usize::from(own.solved);
        self.iterations += own.iterations;
        self.factorisations += own.factorisations;
        self.seconds += own.seconds;
        if own.solved && usual.solved {
            let margin = DIFFERENCE * usual.objective.abs().max(f64::MIN_POSITIVE);
            // Optima of zero differ by rounding.
            let margin = margin.max(1e-9);
            self.worse += usize::from(own.objective > usual.objective + margin);
            self.better += usize::from(own.objective < usual.objective - margin);
        }
        self.changed += usize::from(!own.is_same_path(usual));
    }
}

pub(crate) fn print(variants: &[Variant], rows: &[Row]) {
    let mut sets: Vec<&str> = rows.iter().map(|(instance, _)| instance.set).collect();
    sets.dedup();
    println!(
        "{:38} {:18} {:>7} {:>16} {:>16} {:>5} {:>6} {:>6} {:>7}",
        "variant", "set", "solved", "iterations", "factorisations", "time", "worse", "better", "changed"
    );
    let mut usual_sums = Vec::new();
    for set in &sets {
        let mut sum = Sum::default();
        for (_, (usual, _)) in rows.iter().filter(|(instance, _)| instance.set == *set) {
            sum.add(usual, usual);
        }
        println!(
            "{:38} {set:18} {:>7} {:>16} {:>16} {:>5}",
            "default",
            format!("{}/{}", sum.solved, sum.problems),
            sum.iterations,
            sum.factorisations,
            "1"
        );
        usual_sums.push(sum);
    }
    let mut without_effect = Vec::new();
    for (index, variant) in variants.iter().enumerate() {
        let mut name = variant.name;
        for (set, usual_sum) in sets.iter().zip(&usual_sums) {
            let mut sum = Sum::default();
            for (_, (usual, own)) in rows.iter().filter(|(instance, _)| instance.set == *set) {
                if let Some(own) = &own[index] {
                    sum.add(own, usual);
                }
            }
            if sum.changed == 0 {
                continue;
            }
            let relative =
                |own: usize, usual: usize| format!("{own} {:+.1} %", 100.0 * (own as f64 / usual.max(1) as f64 - 1.0));
            println!(
                "{name:38} {set:18} {:>7} {:>16} {:>16} {:>5.2} {:>6} {:>6} {:>7}",
                format!("{}/{}", sum.solved, sum.problems),
                relative(sum.iterations, usual_sum.iterations),
                relative(sum.factorisations, usual_sum.factorisations),
                sum.seconds / usual_sum.seconds,
                sum.worse,
                sum.better,
                sum.changed
            );
            name = "";
        }
        if !name.is_empty() {
            without_effect.push(name);
        }
    }
    println!("\nno effect on any problem: {}", without_effect.join("; "));
}
