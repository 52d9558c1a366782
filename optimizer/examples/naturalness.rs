//! Effect of each naturalness term on Gait RMSE, cost, solve time, and values that clinicians look at.
//!
//! `cargo run --release -p gait-optimizer --example naturalness -- [--subject 1] [--muscles off] [--folder FOLDER]`: one CSV
//! row per set of settings, each solved cold with the default bounds; with a folder every gait as a file, for
//! `gaitwright convert --to tiles`.

mod arguments;

use arguments::argument;
use gait_optimizer::body::{Axis, Side};
use gait_optimizer::gait::DomainTrajectory;
use gait_optimizer::{
    CancelToken, Gait, GaitProblem, GaitSettings, LocalOptimumChoice, Mesh, SolveOptions, Subject, solve,
};
use std::error::Error;
use std::path::Path;

/// Settings of a solve, changed by a naturalness term.
struct Variant {
    name: &'static str,
    settings: GaitSettings,
    local_optimum_choice: LocalOptimumChoice,
    initial_guesses: usize,
    /// Then solved on a mesh twice as fine.
    finer: bool,
}

impl Variant {
    fn new(name: &'static str, change: impl Fn(&mut GaitSettings)) -> Self {
        let mut settings = GaitSettings::default();
        change(&mut settings);
        let SolveOptions { local_optimum_choice, initial_guesses, .. } = SolveOptions::default();
        Self { name, settings, local_optimum_choice, initial_guesses, finer: false }
    }

    /// Of four initial guesses the gait nearest to the reference among those that cost at most 3 % more than the cheapest.
    fn nearest_to_reference(self) -> Self {
        Self {
            initial_guesses: 4,
            local_optimum_choice: LocalOptimumChoice::NearestToReference { within_percent: 3.0 },
            ..self
        }
    }
}

fn variants() -> Vec<Variant> {
    let fast = |s: &mut GaitSettings| (s.limits.speed_min_m_s, s.limits.speed_max_m_s) = (1.2, 1.3);
    // Perry and Burnfield 2010: double support of about 12 % of the stride per step, 0.13 s of 1.1 s.
    let long_double_support =
        |s: &mut GaitSettings| (s.limits.duration_min_s.ds2, s.limits.duration_min_s.ds3) = (0.06, 0.06);
    let loaded = |s: &mut GaitSettings| s.naturalness.trailing_load_share = 0.5;
    let tracking = |weight: f64| move |s: &mut GaitSettings| s.naturalness.reference_weight = weight;
    let plain = || Variant::new("none", |_| {});
    vec![
        plain(),
        Variant { name: "nearest of four guesses within 3 %", ..plain().nearest_to_reference() },
        Variant { name: "mesh twice as fine", finer: true, ..plain() },
        Variant::new("speed 1.2 to 1.3 m/s", fast),
        Variant::new("double support of 0.12 s", long_double_support),
        Variant::new("gradual weight transfer", loaded),
        Variant::new("gradual transfer in 0.12 s", |s| {
            long_double_support(s);
            loaded(s);
        }),
        Variant::new("reference weight 0.01", tracking(0.01)),
        Variant::new("reference weight 0.1", tracking(0.1)),
        Variant::new("reference weight 1", tracking(1.0)),
        Variant::new("all, reference weight 0.1", |s| {
            fast(s);
            long_double_support(s);
            loaded(s);
            tracking(0.1)(s);
        }),
    ]
}

/// Largest flexion of a knee, degrees.
fn peak_degrees(gait: &Gait, coordinate: usize) -> f64 {
    let angles = gait.domains.iter().flat_map(|domain| domain.q.iter().map(|q| q[coordinate]));
    angles.fold(f64::NEG_INFINITY, f64::max).to_degrees()
}

/// Share of the vertical force that the trailing foot carries in double support, mean over time.
fn trailing_share(gait: &Gait) -> f64 {
    let double_support = || gait.domains.iter().filter(|domain| domain.name.starts_with("DS"));
    let stance = |domain: &DomainTrajectory| if domain.name.ends_with('R') { Side::Right } else { Side::Left };
    let trailing: f64 = double_support().map(|d| impulse(d, |side| side != stance(d))).sum();
    trailing / double_support().map(|d| impulse(d, |_| true)).sum::<f64>()
}

/// Vertical impulse under some feet, N s.
fn impulse(domain: &DomainTrajectory, counts: impl Fn(Side) -> bool) -> f64 {
    let rows = domain.contact_rows.iter().enumerate().filter(|(_, row)| row.axis == Axis::Z && counts(row.side));
    let columns: Vec<usize> = rows.map(|(c, _)| c).collect();
    let sum: f64 = domain.contact_forces.iter().flat_map(|forces| columns.iter().map(|&c| forces[c])).sum();
    sum / domain.contact_forces.len() as f64 * domain.duration_s
}

fn main() -> Result<(), Box<dyn Error>> {
    let subject = Subject::builtin(argument("--subject", "1").parse()?)?;
    let muscles = argument("--muscles", "off") == "on";
    let folder = argument("--folder", "");
    println!(
        "variant,status,gait_rmse_rad,cost_of_transport,iterations,seconds,speed_m_s,double_support_percent,\
         trailing_share_percent,left_knee_peak_deg,right_knee_peak_deg"
    );
    for Variant { name, settings, local_optimum_choice, initial_guesses, finer } in variants() {
        let mut problem = GaitProblem { settings, ..GaitProblem::new(subject, muscles)? };
        let options = SolveOptions { threads: 2, local_optimum_choice, initial_guesses, ..SolveOptions::default() };
        let solve_from = |problem: &GaitProblem, warm| solve(problem, warm, &options, &mut |_| {}, &CancelToken::new());
        let mut outcome = solve_from(&problem, None)?;
        let (mut iterations, mut seconds) = (outcome.report.iterations, outcome.report.seconds_total);
        if finer {
            let Mesh { ds2, ds3, ss2, ss1 } = problem.settings.mesh;
            problem.settings.mesh = Mesh { ds2: 2 * ds2, ds3: 2 * ds3, ss2: 2 * ss2, ss1: 2 * ss1 };
            outcome = solve_from(&problem, Some(&outcome.warm_start))?;
            iterations += outcome.report.iterations;
            seconds += outcome.report.seconds_total;
        }
        let (gait, report) = (&outcome.gait, &outcome.report);
        if !folder.is_empty() {
            let file = Path::new(&folder)
                .join(format!("{}.json", name.replace(' ', "_").replace('/', "_per_").replace('%', "percent")));
            std::fs::write(file, serde_json::to_string(gait)?)?;
        }
        let double: f64 = gait.domains.iter().filter(|d| d.name.starts_with("DS")).map(|d| d.duration_s).sum();
        println!(
            "\"{name}\",{:?},{:.4},{:.5},{},{:.1},{:.3},{:.1},{:.1},{:.1},{:.1}",
            report.status,
            report.gait_rmse_rad,
            report.cost_of_transport,
            iterations,
            seconds,
            report.speed_m_s,
            100.0 * double / gait.stride_time_s,
            100.0 * trailing_share(gait),
            peak_degrees(gait, 4),
            peak_degrees(gait, 7),
        );
    }
    Ok(())
}
