//! Objective and joint angles as functions of the mesh. Each mesh starts from the gait of the previous one.
//!
//! `cargo run --release -p gait-optimizer --example mesh_study -- [--subject 1] [--muscles on] [--threads 2] [--finest
//! 3]` prints one CSV row for the default mesh (intervals 4,4,6,6) and for each refinement by two. Differences are
//! relative to the previous row, at the common nodes.

mod arguments;

use arguments::argument;
use gait_optimizer::{CancelToken, GaitProblem, Mesh, SolveOptions, SolveOutcome, Subject, solve};
use std::error::Error;

/// Largest and RMS difference of the seven joint angles between a mesh and its refinement, at the nodes of the coarser
/// mesh, rad.
fn difference_of_angles(coarse: &SolveOutcome, fine: &SolveOutcome) -> (f64, f64) {
    let (mut largest, mut squares, mut count) = (0.0_f64, 0.0, 0.0);
    for (a, b) in coarse.gait.domains.iter().zip(&fine.gait.domains) {
        for (x, y) in a.q.iter().zip(b.q.iter().step_by(2)) {
            for (x, y) in x.iter().zip(y).skip(2) {
                largest = largest.max((x - y).abs());
                squares += (x - y).powi(2);
                count += 1.0;
            }
        }
    }
    (largest, (squares / count).sqrt())
}

fn main() -> Result<(), Box<dyn Error>> {
    let muscles = argument("--muscles", "on") == "on";
    let threads: usize = argument("--threads", "2").parse()?;
    let finest: u32 = argument("--finest", "3").parse()?;
    let default = GaitProblem::new(Subject::builtin(argument("--subject", "1").parse()?)?, muscles)?;
    println!(
        "intervals,variables,started_from,status,iterations,seconds,objective,cost_of_transport,gait_rmse_rad,largest_angle_difference_rad,rms_angle_difference_rad"
    );
    let mut before: Option<SolveOutcome> = None;
    for factor in (0..finest).map(|power| 2usize.pow(power)) {
        let mut problem = default.clone();
        let Mesh { ds2, ds3, ss2, ss1 } = default.settings.mesh;
        problem.settings.mesh = Mesh { ds2: factor * ds2, ds3: factor * ds3, ss2: factor * ss2, ss1: factor * ss1 };
        let options = SolveOptions { threads, ..SolveOptions::default() };
        let warm = before.as_ref().map(|outcome| &outcome.warm_start);
        let outcome = solve(&problem, warm, &options, &mut |_| {}, &CancelToken::new())?;
        let (largest, rms) = before.as_ref().map_or((f64::NAN, f64::NAN), |b| difference_of_angles(b, &outcome));
        let r = &outcome.report;
        println!(
            "{},{},{:?},{:?},{},{:.2},{:.8},{:.8},{:.4},{largest:.5},{rms:.5}",
            factor * (2 * (ds2 + ds3 + ss2 + ss1)),
            r.variables,
            r.started_from,
            r.status,
            r.iterations,
            r.seconds_total,
            r.objective,
            r.cost_of_transport,
            r.gait_rmse_rad
        );
        before = Some(outcome);
    }
    Ok(())
}
