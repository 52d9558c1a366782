//! `gaitwright simulate`: simulates walks with a gait, by a model other than the optimiser's.

use super::flag_numbers::{number, seed, whole};
use super::gait_file::read_gait_file;
use super::output::data;
use clap::Args;
use gait_optimizer::CancelToken;
use gait_optimizer::execution::{ExecutionOptions, ExecutionReport, SimulatedWalksOnGround, simulate};
use gaitwright_compute::Pool;
use gaitwright_service::error::Error;
use std::path::PathBuf;
use std::sync::atomic::AtomicU32;

#[derive(Debug, Args)]
pub(super) struct SimulateCommand {
    /// File written by `solve --out`, or a gait downloaded from the service.
    #[arg(value_name = "GAIT.json")]
    gait: PathBuf,
    /// Number of simulated walks with random disturbances on each kind of ground.
    #[arg(long, value_name = "NUMBER", default_value_t = ExecutionOptions::default().number_of_simulated_walks, value_parser = simulated_walks, allow_negative_numbers = true)]
    simulated_walks: u32,
    /// Largest height of bumps and depth of dips in the ground, 0 (level) to 50 mm (default: 0, 5 and 10 in turn).
    #[arg(long, value_name = "MILLIMETRES", value_parser = ground, allow_negative_numbers = true)]
    ground: Option<f64>,
    /// Seed for the disturbances.
    #[arg(long, value_name = "NUMBER", default_value_t = ExecutionOptions::default().seed, value_parser = seed, allow_negative_numbers = true)]
    seed: u64,
    /// Print the report as one JSON object.
    #[arg(long)]
    json: bool,
}

fn simulated_walks(text: &str) -> Result<u32, String> {
    whole(text, 1, ExecutionOptions::MAX_SIMULATED_WALKS)
}

/// A height in millimetres, because the error of the library names its own field, in metres.
fn ground(text: &str) -> Result<f64, String> {
    let most = 1000.0 * ExecutionOptions::MAX_GROUND_M;
    match number(text) {
        Ok(millimetres) if (0.0..=most).contains(&millimetres) => Ok(millimetres),
        _ => Err(format!("must be a number from 0 to {most}")),
    }
}

impl SimulateCommand {
    /// Simulates the walks. Falls are a result, not an error.
    pub(super) async fn run(self) -> Result<(), Error> {
        let mut options = ExecutionOptions {
            number_of_simulated_walks: self.simulated_walks,
            seed: self.seed,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            ..ExecutionOptions::default()
        };
        if let Some(millimetres) = self.ground {
            options.ground_heights_m = vec![millimetres / 1000.0];
        }
        options.validate()?;
        let gait = read_gait_file(&self.gait)?.gait;
        let (done, cancel) = (AtomicU32::new(0), CancelToken::new());
        let report = Pool::new(1).run(move |_| simulate(&gait, &options, &done, &cancel)).await??;
        let report = report.ok_or_else(|| Error::Internal("the simulation ended without a report".to_owned()))?;
        if self.json {
            data(&serde_json::to_string_pretty(&report).map_err(|e| Error::Internal(e.to_string()))?)
        } else {
            data(&for_people(&report))
        }
    }
}

/// The report as text.
fn for_people(report: &ExecutionReport) -> String {
    let strides = report.strides;
    let mut lines = vec![
        format!("simulated walks of {strides} strides, gait {}", report.gait_sha256),
        format!("  undisturbed: {} of {strides} strides", report.undisturbed_strides),
    ];
    let by_yield: Vec<String> = report
        .strides_by_yield
        .iter()
        .map(|walk| format!("{} at {:.0} mm", strides_in_words(walk.strides), 1000.0 * walk.yield_m))
        .collect();
    lines.push(format!(
        "  undisturbed simulated walks, by how far the ground yields under body weight: {}",
        by_yield.join(", ")
    ));
    let [lightest, heaviest] = report.body_mass_kg;
    lines.push(format!("  disturbed simulated walks: body mass {lightest:.1} to {heaviest:.1} kg"));
    lines.extend(report.grounds.iter().flat_map(ground_for_people));
    lines.push(match report.pushes {
        Some(pushes) => format!(
            "  largest push at the hip that the walker survives: {:.0} N s forwards, {:.0} N s backwards (largest push tried: {:.0} N s)",
            pushes.forwards_n_s, pushes.backwards_n_s, pushes.largest_tried_n_s
        ),
        None => "  pushes at the hip: not tried, because the undisturbed walk is not complete".to_owned(),
    });
    lines.push(
        "  the intact side is a model of a person who tracks the gait; a real person may do better or worse".to_owned(),
    );
    lines.join("\n")
}

fn strides_in_words(strides: u32) -> String {
    format!("{strides} {}", if strides == 1 { "stride" } else { "strides" })
}

fn ground_for_people(ground: &SimulatedWalksOnGround) -> [String; 2] {
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let [low, high] = ground.completed_share_interval;
    [
        format!(
            "  {}: {} of {} simulated walks complete ({}, 95 % interval {} to {}); on average {:.1} strides; falls: {}, halts: {}",
            ground.ground_in_words(),
            ground.completed,
            ground.number_of_simulated_walks,
            percent(ground.completed_share),
            percent(low),
            percent(high),
            ground.mean_strides,
            ground.fell,
            ground.halted
        ),
        format!(
            "    torque at its limit: knee {}, ankle {} of the time; torque rate at its limit: knee {}, ankle {}",
            percent(ground.knee_saturated_share),
            percent(ground.ankle_saturated_share),
            percent(ground.knee_rate_limited_share),
            percent(ground.ankle_rate_limited_share)
        ),
    ]
}
