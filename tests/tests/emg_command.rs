//! `gaitwright emg`: processes a recording without the service, with the same results.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_tests::cli;
use gaitwright_tests::measured::electromyogram;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Output;
use tempfile::TempDir;

fn emg(folder: &Path, arguments: &[&str]) -> Output {
    cli::run(env!("CARGO_BIN_EXE_gaitwright-cli"), folder, &[&["emg"], arguments].concat())
}

/// Normal walking, and a walk whose left tibialis anterior is half as strong again.
fn recordings() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("normal.csv"), electromyogram(1.0)).unwrap();
    std::fs::write(folder.path().join("walk.csv"), electromyogram(1.5)).unwrap();
    folder
}

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = emg(folder, arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

const BY_NORMAL: [&str; 5] = ["walk.csv", "--normal", "normal.csv", "--heel-strike-column", "heel"];

#[test]
fn emg_command_compares_a_walk_with_normal_walking() {
    let folder = recordings();
    insta::assert_snapshot!("emg", done(folder.path(), &BY_NORMAL));
    let files = ["--json", "--cycles", "cycles.csv", "--envelopes", "envelopes.csv"];
    let found: Value = serde_json::from_str(&done(folder.path(), &[&BY_NORMAL[..], &files].concat())).unwrap();
    assert_eq!(found["settings"], json!({"band_low_hz": 20.0, "band_high_hz": 450.0, "envelope_hz": 6.0, "order": 4}));
    assert_eq!(found["heel_strikes_s"].as_array().unwrap().len(), 6);
    let alone: Value =
        serde_json::from_str(&done(folder.path(), &["normal.csv", "--heel-strike-column", "heel", "--json"])).unwrap();
    assert!(alone["emg_rmse"].is_null());
    // One channel is 1.5 times as strong: 0.5 times the RMS of its normal curve.
    let normal: Vec<f64> = curve(&alone, 1);
    let by_hand = 0.5 * (normal.iter().map(|value| value * value).sum::<f64>() / 101.0).sqrt();
    assert!((found["emg_rmse"]["total"].as_f64().unwrap() - by_hand).abs() < 1e-5);
    assert!((found["averages"][1].as_f64().unwrap() / alone["averages"][1].as_f64().unwrap() - 1.5).abs() < 1e-5);

    let cycles = columns(&folder.path().join("cycles.csv"));
    assert_eq!(cycles[0].0, "percent");
    assert_eq!((cycles[3].0.as_str(), &cycles[3].1), ("TA_L", &curve(&found, 1)));
    assert_eq!(cycles.len(), 13);
    let envelopes = columns(&folder.path().join("envelopes.csv"));
    let names: Vec<&str> = envelopes.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["time_s", "RF_L", "TA_L", "BF_L", "GAS_L", "RF_R", "BF_R"]);
    assert_eq!((envelopes[0].1.len(), envelopes[0].1[5999]), (6000, 5.999));
}

fn curve(found: &Value, channel: usize) -> Vec<f64> {
    let mean = found["channels"][channel]["mean"].as_array().unwrap();
    mean.iter().map(|value| value.as_f64().unwrap()).collect()
}

/// The columns of a CSV file.
fn columns(path: &Path) -> Vec<(String, Vec<f64>)> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names = lines.next().unwrap().split(',');
    let mut columns: Vec<(String, Vec<f64>)> = names.map(|name| (name.to_owned(), Vec::new())).collect();
    for line in lines {
        for (column, cell) in columns.iter_mut().zip(line.split(',')) {
            column.1.push(cell.parse().unwrap());
        }
    }
    columns
}

#[test]
fn named_columns_and_an_opensim_file_give_the_same_result() {
    let folder = recordings();
    let at = |name: &str| folder.path().join(name);
    let text = electromyogram(1.0);
    let rows: Vec<String> = text.lines().skip(1).map(|line| line.replace(',', "\t")).collect();
    let head = "walk\nversion=1\nnRows=6000\nnColumns=8\ninDegrees=no\nendheader\n";
    let names = "time\te1\te2\te3\te4\te5\te6\tswitch";
    std::fs::write(at("walk.sto"), format!("{head}{names}\n{}\n", rows.join("\n"))).unwrap();
    let filters = ["--json", "--band-low-hz", "30", "--band-high-hz", "400", "--envelope-hz", "5", "--order", "2"];
    let channels = ["--channels", "TA_L=e2,GAS_L=e4", "--heel-strike-column", "switch", "--format", "opensim"];
    let sto = done(folder.path(), &[&["walk.sto"], &channels[..], &filters].concat());
    let same = ["--channels", "TA_L=TA_L,GAS_L=GAS_L", "--heel-strike-column", "heel"];
    let csv = done(folder.path(), &[&["normal.csv"], &same[..], &filters].concat());
    assert_eq!(sto, csv);
    let found: Value = serde_json::from_str(&csv).unwrap();
    assert_eq!(found["settings"], json!({"band_low_hz": 30.0, "band_high_hz": 400.0, "envelope_hz": 5.0, "order": 2}));
    assert_eq!(found["channels"].as_array().unwrap().len(), 2);
    let given = ["normal.csv", "--heel-strikes-s", "0.401,1.501,2.601", "--json"];
    let found: Value = serde_json::from_str(&done(folder.path(), &given)).unwrap();
    assert_eq!(found["channels"][0]["strides"], 2);
}

#[test]
fn unprocessable_file_is_refused_and_writes_nothing() {
    let folder = recordings();
    let whole = electromyogram(1.0);
    std::fs::write(folder.path().join("half.csv"), &whole[..whole.find("\n1.5,").unwrap() + 9]).unwrap();
    std::fs::write(folder.path().join("word.csv"), whole.replace("\n1.5,", "\n1.5,x")).unwrap();
    let before = cli::files(folder.path());
    let column = ["--heel-strike-column", "heel"];
    for (arguments, expected) in [
        (&["half.csv", column[0], column[1]][..], "half.csv, line 1502"),
        (&["word.csv", column[0], column[1]], "word.csv, line 1502, column 2"),
        (&["walk.csv", "--normal", "word.csv", column[0], column[1]], "word.csv, line 1502, column 2"),
        (&["nowhere.csv", column[0], column[1]], "Cannot read nowhere.csv"),
        (&["walk.csv"], "at least two heel-strike times"),
        (&["walk.csv", "--heel-strike-column", "toe"], "column \"toe\" is missing"),
        (&["walk.csv", "--heel-strikes-s", "0.4,99"], "--heel-strikes-s is 99;"),
        (
            &["walk.csv", column[0], column[1], "--band-high-hz", "500"],
            "--band-high-hz is 500; it must be 21 to 495 Hz, above the lower cut-off.",
        ),
        (&["walk.csv", column[0], column[1], "--order", "3"], "--order is \"3\"; it must be 2, 4, 6 or 8"),
        (&["walk.csv", column[0], column[1], "--channels", "TA"], "must be CHANNEL=COLUMN"),
        (&["walk.csv", column[0], column[1], "--channels", "XX=TA_L"], "RF_L, TA_L, BF_L"),
        (&["walk.csv", column[0], column[1], "--rate-hz", "NaN"], "--rate-hz is NaN;"),
        (&["walk.csv", column[0], column[1], "--cycles", "walk.csv"], "is an input of this command"),
    ] {
        let output = emg(folder.path(), &[arguments, &["--envelopes", "e.csv"]].concat());
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && text.contains(expected), "{arguments:?}: {text}");
        assert!(output.stdout.is_empty());
        assert_eq!(cli::files(folder.path()), before, "{arguments:?}");
    }
}
