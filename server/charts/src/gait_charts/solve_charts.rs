//! The progress of a solve.

use crate::{Chart, Figure, Stroke};
use gait_optimizer::IterationRecord;
use gait_optimizer::solve::SolvePhase;

/// Name of a phase in a chart.
fn phase_in_words(phase: SolvePhase) -> &'static str {
    match phase {
        SolvePhase::Tracking => "tracking",
        SolvePhase::MuscleTracking => "tracking with muscles",
        SolvePhase::PlainCost => "cost without muscles",
        SolvePhase::Cost => "cost",
        SolvePhase::InterNode => "bounds tightened between nodes",
    }
}

/// Where each phase of each guess begins.
fn solve_phases(iterations: &[&IterationRecord]) -> Vec<(f64, String)> {
    let several = iterations.iter().any(|r| r.guess != iterations[0].guess);
    let mut starts = Vec::new();
    let mut last = None;
    for (i, r) in iterations.iter().enumerate() {
        // A phase that runs again, in a cold start after a warm one, counts its iterations from zero.
        let again = i > 0 && r.iteration < iterations[i - 1].iteration;
        if last == Some((r.guess, r.phase)) && !again {
            continue;
        }
        last = Some((r.guess, r.phase));
        let phase = phase_in_words(r.phase);
        let of_guess = several && r.phase != SolvePhase::InterNode;
        let name = if of_guess { format!("initial guess {}: {phase}", r.guess + 1) } else { phase.to_owned() };
        starts.push((i as f64, name));
    }
    starts
}

/// The progress of a solve; `None` before its second iteration.
pub fn solve(iterations: &[IterationRecord]) -> Option<Figure> {
    // One point is no line.
    (iterations.len() > 1).then(|| Figure::chart("solve", of_iterations(iterations)))
}

fn of_iterations(iterations: &[IterationRecord]) -> Chart {
    // Guesses that were solved in parallel are drawn one after the other.
    let mut iterations: Vec<&IterationRecord> = iterations.iter().collect();
    iterations.sort_by_key(|r| r.guess);
    let line = |f: fn(&IterationRecord) -> f64| -> Vec<(f64, f64)> {
        iterations.iter().enumerate().map(|(i, r)| (i as f64, f(r))).collect()
    };
    let mut chart =
        Chart::new("Violation, dual infeasibility, barrier parameter and objective", "iteration", "scaled, no unit")
            .with("violation", 0, Stroke::Solid, line(|r| r.constraint_violation))
            .with("dual infeasibility", 1, Stroke::Dashed, line(|r| r.dual_infeasibility))
            .with("barrier parameter", 2, Stroke::Solid, line(|r| r.barrier))
            .with("objective", 3, Stroke::Dashed, line(|r| r.objective.abs()));
    chart.whole_x = true;
    chart.log_y = true;
    chart.marks = solve_phases(&iterations);
    chart
}
