//! What the regularisation of activation and fibre velocity does: objective, cost and alternation of the activations
//! from mesh point to mesh point with and without each.
//!
//! `cargo run --release -p gait-optimizer --example activation_smoothness -- [--subject 1]`. Columns: the
//! root-mean-square bend (second difference) within mesh intervals, of the activations and of the fibre velocities
//! (optimal lengths per second); alternations (three steps between neighbouring points that change sign twice, each
//! above 0.005); the largest step between neighbouring points.

use gait_optimizer::gait::MuscleTrajectory;
use gait_optimizer::settings::Regularisation;
use gait_optimizer::{CancelToken, Gait, GaitProblem, SolveOptions, Subject, WarmStart, solve};
use std::error::Error;

/// Steps below this are no alternation.
const STEP: f64 = 0.005;

fn muscles(gait: &Gait) -> impl Iterator<Item = &MuscleTrajectory> {
    gait.domains.iter().filter_map(|domain| domain.muscles.as_ref())
}

/// Root mean square of the second differences within mesh intervals.
fn bend(gait: &Gait, pick: fn(&MuscleTrajectory) -> &Vec<[f64; 10]>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for series in muscles(gait).map(pick) {
        for interval in series.windows(3).step_by(2) {
            for m in 0..10 {
                sum += (interval[0][m] - 2.0 * interval[1][m] + interval[2][m]).powi(2);
                count += 1;
            }
        }
    }
    (sum / count.max(1) as f64).sqrt()
}

/// Alternations and the largest step.
fn alternations(gait: &Gait) -> (usize, f64) {
    let (mut count, mut largest) = (0, 0.0f64);
    for trajectory in muscles(gait) {
        for m in 0..10 {
            let steps: Vec<f64> = trajectory.activation.windows(2).map(|w| w[1][m] - w[0][m]).collect();
            count += steps
                .windows(3)
                .filter(|s| s[0] * s[1] < 0.0 && s[1] * s[2] < 0.0 && s.iter().all(|step| step.abs() > STEP))
                .count();
            largest = steps.iter().fold(largest, |a, s| a.max(s.abs()));
        }
    }
    (count, largest)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let subject = arguments.iter().position(|a| a == "--subject").and_then(|i| arguments.get(i + 1));
    let subject: u32 = subject.map_or(Ok(1), |s| s.parse())?;
    let base = GaitProblem::new(Subject::builtin(subject)?, true)?;
    let default = base.settings.regularisation;
    let reference = Regularisation { activation_bend: 0.0, ..default };
    let variants = [
        ("default", default),
        ("0.3 x bend", Regularisation { activation_bend: 0.3 * default.activation_bend, ..default }),
        ("3 x bend", Regularisation { activation_bend: 3.0 * default.activation_bend, ..default }),
        ("no bend (reference problem)", reference),
        ("no bend, 10 x fibre velocity", Regularisation { fibre_velocity: 0.1, ..reference }),
        ("no bend, no activation", Regularisation { activation: 0.0, ..reference }),
        ("no bend, no fibre velocity", Regularisation { fibre_velocity: 0.0, ..reference }),
        ("none", Regularisation { activation: 0.0, fibre_velocity: 0.0, ..reference }),
    ];
    println!(
        "variant,status,iterations,objective,cost_of_transport,gait_rmse_rad,mean_activation,activation_bend,fibre_velocity_bend,alternations,largest_step"
    );
    let mut warm: Option<WarmStart> = None;
    for (name, regularisation) in variants {
        let mut problem = base.clone();
        problem.settings.regularisation = regularisation;
        let options = SolveOptions { max_iterations: 400, ..SolveOptions::default() };
        let outcome = solve(&problem, warm.as_ref(), &options, &mut |_| {}, &CancelToken::new())?;
        let activations: Vec<f64> =
            muscles(&outcome.gait).flat_map(|trajectory| trajectory.activation.iter().flatten().copied()).collect();
        let mean = activations.iter().sum::<f64>() / activations.len().max(1) as f64;
        let (alternations, largest_step) = alternations(&outcome.gait);
        let r = &outcome.report;
        println!(
            "{name},{:?},{},{:.6},{:.6},{:.4},{mean:.4},{:.5},{:.4},{alternations},{largest_step:.3}",
            r.status,
            r.iterations,
            r.objective,
            r.cost_of_transport,
            r.gait_rmse_rad,
            bend(&outcome.gait, |m| &m.activation),
            bend(&outcome.gait, |m| &m.fibre_velocity),
        );
        warm.get_or_insert(outcome.warm_start);
    }
    Ok(())
}
