//! What the regularisation of activation and fibre velocity does: objective, cost and node-to-node chatter with and
//! without each.
//!
//! `cargo run --release -p gait-optimizer --example activation_smoothness -- [--subject 1]`. Chatter is the
//! root-mean-square third difference between neighbouring mesh points: zero for parabolas, large for alternation.

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

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let subject = arguments.iter().position(|a| a == "--subject").and_then(|i| arguments.get(i + 1));
    let subject: u32 = subject.map_or(Ok(1), |s| s.parse())?;
    let base = GaitProblem::new(Subject::builtin(subject)?, true)?;
    let default = base.settings.regularisation;
    let variants = [
        ("default", default.activation, default.fibre_velocity),
        ("no activation weight", 0.0, default.fibre_velocity),
        ("no fibre-velocity weight", default.activation, 0.0),
        ("neither", 0.0, 0.0),
    ];
    println!(
        "variant,status,iterations,objective,cost_of_transport,gait_rmse_rad,mean_activation,activation_chatter,fibre_velocity_chatter"
    );
    let mut warm: Option<WarmStart> = None;
    for (name, activation, fibre_velocity) in variants {
        let mut problem = base.clone();
        problem.settings.regularisation.activation = activation;
        problem.settings.regularisation.fibre_velocity = fibre_velocity;
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
        let r = &outcome.report;
        println!(
            "{name},{:?},{},{:.6},{:.6},{:.4},{mean:.4},{:.5},{:.4}",
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
