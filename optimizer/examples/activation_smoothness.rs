//! Effect of the regularisation of activations and fibre velocities on objective, cost and alternations of the
//! activations.
//!
//! `cargo run --release -p gait-optimizer --example activation_smoothness -- [--subject 1]`. The columns are the RMS
//! bend (second difference at adjacent nodes) of activations and of fibre velocities (optimal fibre lengths per
//! second); the same over the ends of mesh intervals; the alternations (three steps of alternating sign, each above
//! 0.005) at nodes and at ends of intervals; and the largest step between adjacent nodes.

use gait_optimizer::activation_alternations::{activation_alternations, alternations};
use gait_optimizer::gait::MuscleTrajectory;
use gait_optimizer::settings::Regularisation;
use gait_optimizer::{CancelToken, Gait, GaitProblem, SolveOptions, Subject, WarmStart, solve};
use std::error::Error;

fn muscles(gait: &Gait) -> impl Iterator<Item = &MuscleTrajectory> {
    gait.domains.iter().filter_map(|domain| domain.muscles.as_ref())
}

/// Values of a muscle in a domain at every `stride`-th node.
fn lines(
    gait: &Gait,
    pick: fn(&MuscleTrajectory) -> &Vec<[f64; 10]>,
    stride: usize,
) -> impl Iterator<Item = Vec<f64>> + '_ {
    muscles(gait).flat_map(move |trajectory| {
        (0..10).map(move |m| pick(trajectory).iter().step_by(stride).map(|values| values[m]).collect())
    })
}

/// Root mean square of the second differences.
fn bend(lines: impl Iterator<Item = Vec<f64>>) -> f64 {
    let squares: Vec<f64> =
        lines.flat_map(|l| l.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).powi(2)).collect::<Vec<_>>()).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
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
        ("10 x bend", Regularisation { activation_bend: 10.0 * default.activation_bend, ..default }),
        ("no bend (reference problem)", reference),
        ("no bend, 10 x fibre velocity", Regularisation { fibre_velocity: 0.1, ..reference }),
        ("no bend, no activation", Regularisation { activation: 0.0, ..reference }),
        ("no bend, no fibre velocity", Regularisation { fibre_velocity: 0.0, ..reference }),
        ("none", Regularisation { activation: 0.0, fibre_velocity: 0.0, ..reference }),
    ];
    println!(
        "variant,status,iterations,objective,cost_of_transport,gait_rmse_rad,mean_activation,activation_bend,bend_of_interval_ends,fibre_velocity_bend,alternations,alternations_of_interval_ends,largest_step"
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
        let activation = |stride| lines(&outcome.gait, |m| &m.activation, stride);
        let largest_step = activation(1)
            .flat_map(|line| line.windows(2).map(|w| (w[1] - w[0]).abs()).collect::<Vec<_>>())
            .fold(0.0f64, f64::max);
        let r = &outcome.report;
        println!(
            "{name},{:?},{},{:.6},{:.6},{:.4},{mean:.4},{:.5},{:.5},{:.4},{},{},{largest_step:.3}",
            r.status,
            r.iterations,
            r.objective,
            r.cost_of_transport,
            r.gait_rmse_rad,
            bend(activation(1)),
            bend(activation(2)),
            bend(lines(&outcome.gait, |m| &m.fibre_velocity, 1)),
            activation_alternations(&outcome.gait),
            activation(2).map(|line| alternations(&line)).sum::<usize>(),
        );
        warm.get_or_insert(outcome.warm_start);
    }
    Ok(())
}
