//! What the regularisation of activation and fibre velocity does: objective, cost and node-to-node chatter with and
//! without each.
//!
//! `cargo run --release -p gait-optimizer --example activation_smoothness -- [--subject 1]`. Chatter is the
//! root-mean-square third difference between neighbouring mesh points: zero for parabolas, large for alternation.

use gait_optimizer::settings::Regularisation;
use gait_optimizer::{CancelToken, Gait, GaitProblem, SolveOptions, Subject, WarmStart, solve};
use std::error::Error;

/// RMS of third differences of a series in one domain: zero for parabolas, large for alternation.
fn chatter(gait: &Gait, pick: fn(&gait_optimizer::gait::MuscleTrajectory) -> &Vec<[f64; 10]>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for domain in &gait.domains {
        let Some(muscles) = &domain.muscles else { continue };
        let series = pick(muscles);
        for window in series.windows(4) {
            for m in 0..10 {
                let third = window[3][m] - 3.0 * window[2][m] + 3.0 * window[1][m] - window[0][m];
                sum += third * third;
                count += 1;
            }
        }
    }
    (sum / count.max(1) as f64).sqrt()
}

/// Changes of direction of an activation between neighbouring points, both steps above 0.01, and the largest step within
/// a domain.
fn reversals(gait: &Gait) -> (usize, f64) {
    let (mut count, mut largest) = (0, 0.0f64);
    for muscles in gait.domains.iter().filter_map(|d| d.muscles.as_ref()) {
        for m in 0..10 {
            let steps: Vec<f64> = muscles.activation.windows(2).map(|w| w[1][m] - w[0][m]).collect();
            count += steps.windows(2).filter(|s| s[0] * s[1] < 0.0 && s[0].abs().min(s[1].abs()) > 0.01).count();
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
    let variants = [
        ("default", default),
        ("no activation weight", Regularisation { activation: 0.0, ..default }),
        ("no fibre-velocity weight", Regularisation { fibre_velocity: 0.0, ..default }),
        ("neither", Regularisation { activation: 0.0, fibre_velocity: 0.0, ..default }),
        ("10 x fibre velocity", Regularisation { fibre_velocity: 10.0 * default.fibre_velocity, ..default }),
        ("100 x fibre velocity", Regularisation { fibre_velocity: 100.0 * default.fibre_velocity, ..default }),
        ("10 x activation", Regularisation { activation: 10.0 * default.activation, ..default }),
        ("10 x torque", Regularisation { torque: 10.0 * default.torque, ..default }),
        ("10 x acceleration", Regularisation { acceleration: 10.0 * default.acceleration, ..default }),
    ];
    println!(
        "variant,status,iterations,objective,cost_of_transport,gait_rmse_rad,mean_activation,activation_chatter,fibre_velocity_chatter,reversals,largest_step"
    );
    let mut warm: Option<WarmStart> = None;
    for (name, regularisation) in variants {
        let mut problem = base.clone();
        problem.settings.regularisation = regularisation;
        let options = SolveOptions { max_iterations: 400, ..SolveOptions::default() };
        let outcome = solve(&problem, warm.as_ref(), &options, &mut |_| {}, &CancelToken::new())?;
        let activations: Vec<f64> = outcome
            .gait
            .domains
            .iter()
            .filter_map(|d| d.muscles.as_ref())
            .flat_map(|m| m.activation.iter().flatten().copied())
            .collect();
        let mean = activations.iter().sum::<f64>() / activations.len().max(1) as f64;
        let (reversals, largest_step) = reversals(&outcome.gait);
        let r = &outcome.report;
        println!(
            "{name},{:?},{},{:.6},{:.6},{:.4},{mean:.4},{:.5},{:.4},{reversals},{largest_step:.3}",
            r.status,
            r.iterations,
            r.objective,
            r.cost_of_transport,
            r.gait_rmse_rad,
            chatter(&outcome.gait, |m| &m.activation),
            chatter(&outcome.gait, |m| &m.fibre_velocity),
        );
        warm.get_or_insert(outcome.warm_start);
    }
    Ok(())
}
