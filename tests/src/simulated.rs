//! An execution report without simulations.

use gait_optimizer::execution::{ExecutionReport, FORMAT_VERSION};
use gaitwright_store::audit::Actor;
use gaitwright_store::execution_reports::{ExecutionReported, REPORTED};
use gaitwright_store::trials::Trial;
use gaitwright_store::{Store, commit, events};
use serde_json::json;

/// A report of 40 walks on each ground, with falls, halts and saturated torques.
///
/// # Panics
/// If the layout of reports has changed.
pub fn report() -> ExecutionReport {
    let ground = |ground_height_m: f64, completed: u32, interval: [f64; 2]| {
        json!({
            "ground_height_m": ground_height_m, "number_of_simulated_walks": 40, "completed": completed, "fell": 38 - completed, "halted": 2,
            "completed_share": f64::from(completed) / 40.0, "completed_share_interval": interval, "mean_strides": 12.3,
            "knee_saturated_share": 0.18, "ankle_saturated_share": 0.0, "knee_rate_limited_share": 0.28,
            "ankle_rate_limited_share": 0.14,
        })
    };
    let yields = [(0.001, 20), (0.002, 20), (0.005, 20), (0.01, 20), (0.02, 3)];
    let yields: Vec<_> = yields.iter().map(|(depth, strides)| json!({"yield_m": depth, "strides": strides})).collect();
    serde_json::from_value(json!({
        "format_version": FORMAT_VERSION, "gait_sha256": "c0".repeat(32), "seed": 7, "strides": 20,
        "body_mass_kg": [62.4, 69.0], "undisturbed_strides": 20,
        "grounds": [ground(0.0, 36, [0.769, 0.960]), ground(0.005, 21, [0.375, 0.670]), ground(0.01, 0, [0.0, 0.088])],
        "strides_by_yield": yields,
        "pushes": {"forwards_n_s": 10.0, "backwards_n_s": 5.0, "largest_tried_n_s": 60.0},
    }))
    .unwrap()
}

/// Stores the report of a trial.
///
/// # Panics
/// If the record cannot be written.
pub async fn keep(store: &Store, trial: &Trial) {
    let program = Actor::program().as_str().to_owned();
    let (number_of_simulated_walks, seed, report) = (40, 7, report());
    let reported = ExecutionReported {
        trial_id: trial.id,
        number: trial.number,
        number_of_simulated_walks,
        seed,
        program,
        report,
    };
    let mut writer = store.write().await.unwrap();
    events::append(&mut writer, trial.study_id, REPORTED, &reported).await.unwrap();
    commit(writer).await.unwrap();
}
