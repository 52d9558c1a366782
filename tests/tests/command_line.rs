//! The command line: what it refuses, and that a refusal changes nothing.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::Path;
use std::process::{Command, Output};

fn gaitwright(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_gaitwright-cli")).current_dir(folder).args(arguments).output().unwrap()
}

/// The arguments are refused with exit code 2, a message that holds `expected`, nothing on stdout and no file left.
#[track_caller]
fn refused(arguments: &[&str], expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    let output = gaitwright(folder.path(), arguments);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains(expected), "{text}");
    assert!(output.stdout.is_empty());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "something was left behind");
}

#[test]
fn a_height_that_nobody_has_is_refused_with_the_allowed_range() {
    for command in ["tune", "solve"] {
        refused(
            &[command, "--height-m", "17.27", "--mass-kg", "65.7"],
            "height_m = 17.27 is outside the allowed range [1.4, 2.2]",
        );
        refused(&[command, "--height-m", "1.727", "--mass-kg", "6570"], "body_mass_kg = 6570");
        refused(&[command, "--height-m", "NaN", "--mass-kg", "65"], "height_m = NaN");
        refused(&[command, "--height-m", "1.727"], "--mass-kg");
    }
}

#[test]
fn an_unknown_subject_is_refused_with_the_known_ones() {
    refused(&["tune", "--subject", "3"], "subject: unknown value \"3\"; known: 1, 2");
    refused(&["solve", "--subject", "0"], "known: 1, 2");
    refused(&["tune", "--subject", "1", "--height-m", "1.7", "--mass-kg", "70"], "cannot be used with");
}

#[test]
fn malformed_bounds_are_refused_by_name() {
    refused(&["solve", "--bounds", "a9=1"], "unknown value \"a9\"");
    refused(&["solve", "--bounds", "a5"], "expected NAME=VALUE");
    refused(&["solve", "--bounds", "a5=high"], "the value is not a number");
    refused(&["solve", "--bounds", "a5=0.1,a5=0.2"], "given twice");
    refused(&["solve", "--bounds", "a1=1000"], "a1 = 1000 is outside the allowed range [1, 100]");
    refused(&["solve", "--bounds", "a3=1.4,a4=1.2"], "a3 = 1.4");
}

#[test]
fn other_nonsense_is_refused() {
    refused(&["tune", "--trials", "0"], "--trials");
    refused(&["tune", "--muscles", "maybe"], "possible values: on, off");
    refused(&["solve", "--mesh", "4,4"], "four whole numbers");
    refused(&["solve", "--mesh", "0,4,6,6"], "mesh.ds2 = 0");
    refused(&["solve", "--tolerance", "5"], "tolerance = 5");
    refused(&["solve", "--warm", "nowhere.json"], "cannot read nowhere.json");
    refused(&["sweep", "--actions", "nowhere.csv", "--out", "x.csv"], "cannot read nowhere.csv");
}

#[test]
fn a_table_of_actions_is_checked_whole_before_anything_is_solved() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = |text: &str| {
        std::fs::write(folder.path().join("actions.csv"), text).unwrap();
        let output = gaitwright(folder.path(), &["sweep", "--actions", "actions.csv", "--out", "out.csv"]);
        assert_eq!(output.status.code(), Some(2));
        assert!(!folder.path().join("out.csv").exists());
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(sweep("a1,a2\n1,2\n").contains("expected \"a1,a2,a3,a4,a5,a6,a7,a8\""));
    assert!(sweep("a1,a2,a3,a4,a5,a6,a7,a8\n").contains("no action"));
    let good = "a1,a2,a3,a4,a5,a6,a7,a8\n20,90,0.3,1.4,0,0.5,50,40\n";
    assert!(sweep(&format!("{good}20,90,0.3,1.4,0,0.5,50\n")).contains("line"));
    assert!(sweep(&format!("{good}20,90,0.3,1.4,0,0.5,fifty,40\n")).contains("line 3: a7: \"fifty\" is not a number"));
    assert!(sweep(&format!("{good}20,90,0.3,1.4,0,0.5,50,400\n")).contains("line 3: a8 = 400"));
}

#[test]
fn a_warm_start_file_of_another_kind_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("x.json"), "{\"report\": 3}").unwrap();
    let output = gaitwright(folder.path(), &["solve", "--warm", "x.json"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("x.json: not a file of `gaitwright solve --out`"));
}

#[test]
fn a_service_without_sign_in_listens_to_this_machine_only() {
    refused(&["serve", "--no-sign-in", "--listen", "0.0.0.0:0"], "without sign-in");
    refused(&["serve", "--listen", "0.0.0.0:0"], "until there is an administrator with a password");
    refused(&["serve", "--listen", "here"], "listen (flag)");
    refused(&["serve", "--tls-key", "k.pem"], "tls_certificate");
}
