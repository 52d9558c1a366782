//! `gaitwright reference` with columns of other names, by the same rules as pages and REST.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gait_optimizer::ReferenceGait;
use gaitwright_tests::cli;
use gaitwright_tests::measured::laboratory_angles;
use serde_json::Value;
use std::process::Output;
use tempfile::TempDir;

const COLUMNS: &str = "torso=Trunk,hip_L=L Hip,knee_L=L Knee,ankle_L=L Ankle,hip_R=R Hip,knee_R=R Knee";

/// Angles in degrees, with that of the left knee in extension.
fn recording() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let file = laboratory_angles([1.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0]);
    std::fs::write(folder.path().join("walk.csv"), file).unwrap();
    folder
}

fn reference(folder: &TempDir, arguments: &[&str]) -> Output {
    let command = ["reference", "walk.csv", "--name", "S03", "--format", "csv"];
    cli::run(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), &[&command, arguments].concat())
}

#[test]
fn reference_command_reads_chosen_columns_with_their_unit_and_sign() {
    let folder = recording();
    let done = reference(&folder, &["--unit", "degrees", "--columns", COLUMNS, "--reversed", "knee_L"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let found: Value = serde_json::from_slice(&done.stdout).unwrap();
    // The recording is the built-in reference gait, cut at its own heel strikes: the same range of the knee.
    let knee = |angles: Vec<f64>| angles.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let rows = found["angles_rad"].as_array().unwrap();
    let read = knee(rows.iter().map(|row| row[2].as_f64().unwrap()).collect());
    let builtin = ReferenceGait::builtin().unwrap();
    let recorded = knee((0..=1000).map(|part| builtin.seven_angles(f64::from(part) / 1000.0)[2]).collect());
    assert!((read - recorded).abs() < 0.01, "{read} {recorded}");
}

#[test]
fn reference_command_refuses_columns_by_the_rules_of_the_page() {
    let folder = recording();
    let unit = ["--unit", "degrees"];
    for (arguments, said) in [
        (&["--columns", COLUMNS][..], "Give the unit of the angles: degrees or radians."),
        (&["--columns", "elbow=Trunk", unit[0], unit[1]], "--columns is \"elbow\"; it must be one of torso, hip_L"),
        (&["--columns", "torso=Trunk,torso=L Hip"], "--columns is \"torso\"; it must be given once for each angle."),
        (&["--columns", "torso=Trunk,hip_L=Trunk", unit[0], unit[1]], "Column \"Trunk\" is chosen for both"),
        (
            &["--columns", COLUMNS, "--reversed", "ankle_R"],
            "--reversed is \"ankle_R\"; it must be one of the angles in",
        ),
        (&["--columns", "Trunk"], "must be JOINT=COLUMN, as in torso=Trunk"),
        (&["--reversed", "torso"], "--columns"),
    ] {
        let refused = reference(&folder, arguments);
        let text = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(!refused.status.success() && refused.stdout.is_empty() && text.contains(said), "{said}: {text}");
    }
}
