//! Certificates of the four default gaits: residuals between nodes, orbit error, multipliers by both methods, and
//! pushes.
//!
//! `cargo run --release -p gait-optimizer --example certificates [-- --all]`; `--all` prints every check.

use gait_optimizer::certificate::{Certificate, STRIDES, certify};
use gait_optimizer::{CancelToken, GaitProblem, SolveOptions, Subject, solve};
use std::error::Error;
use std::time::Instant;

/// The checks of the table by the prefix of their names, with the titles of their columns.
const COLUMNS: [(&str, &str); 6] = [
    ("C1 equations of motion, forces, between", "C1 off mesh, N"),
    ("C2 virtual constraints, between", "C2 off mesh, rad"),
    ("C3 friction cone, between", "friction off mesh, N"),
    ("C5-C7 equilibrium of fibre and tendon, between", "C5-C7 off mesh, F_max"),
    ("orbit error, angles", "orbit, rad"),
    ("orbit error, rates", "orbit, rad/s"),
];

fn main() -> Result<(), Box<dyn Error>> {
    let all = std::env::args().any(|argument| argument == "--all");
    println!("orbit errors over {STRIDES} strides");
    for (subject, muscles) in [(1, false), (1, true), (2, false), (2, true)] {
        let problem = GaitProblem::new(Subject::builtin(subject)?, muscles)?;
        let options = SolveOptions { threads: 2, ..SolveOptions::default() };
        let outcome = solve(&problem, None, &options, &mut |_| {}, &CancelToken::new())?;
        let started = Instant::now();
        let certificate = certify(&outcome.gait)?;
        println!(
            "subject {subject} muscles {muscles}: {:?}, certificate {} ({:.1} s)",
            outcome.report.status,
            if certificate.passed { "passed" } else { "FAILED" },
            started.elapsed().as_secs_f64()
        );
        print(&certificate, all);
    }
    Ok(())
}

fn print(certificate: &Certificate, all: bool) {
    for (name, title) in COLUMNS {
        if let Some(check) = certificate.checks.iter().find(|c| c.name.starts_with(name)) {
            println!("   {title}: {} ({})", check.value_in_words(), check.place);
        }
    }
    if let Some(map) = &certificate.return_map {
        println!(
            "   multipliers: largest {:.5e} (variational), {:.5e} (finite differences, resolution {:.1e}), relative difference {:.1e}",
            map.largest,
            map.largest_by_differences,
            map.differences_resolve,
            map.disagreement()
        );
        println!("   response to a change of speed: {:.3e} (other directions {:.1e})", map.speed_kept, map.speed_leak);
        println!(
            "   gait to periodic motion: {:.1e} rad, {:.1e} rad/s, largest residual there {:.1e}",
            map.fixed_point_distance.angle_rad,
            map.fixed_point_distance.angular_velocity_rad_s,
            map.fixed_point_residual
        );
    }
    if let Some(map) = &certificate.free_hip_return_map {
        println!(
            "   free hip velocity: largest {:.6} (variational), {:.6} (finite differences), relative difference {:.1e}",
            map.largest,
            map.largest_by_differences,
            map.disagreement()
        );
    }
    if let Some(pushes) = certificate.pushes {
        println!(
            "   recovers from pushes of {:.2} m/s forwards, {:.2} m/s backwards",
            pushes.forwards_m_s, pushes.backwards_m_s
        );
    }
    for failure in &certificate.failures {
        println!("   failure: {failure}");
    }
    if all {
        for check in &certificate.checks {
            println!(
                "      {}: {} ({}), limit {}",
                check.name,
                check.value_in_words(),
                check.place,
                check.limit_in_words()
            );
        }
    }
}
