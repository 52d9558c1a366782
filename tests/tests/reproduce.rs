//! The paper's comparison through the command line: minutes of solving, so only with `GAITWRIGHT_LONG_TESTS=1`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright::store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::cli;
use gaitwright_tests::service::Service;

const BINARY: &str = env!("CARGO_BIN_EXE_gaitwright-cli");

#[test]
fn nonsense_is_refused_before_anything_is_solved() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, expected) in [
        (["reproduce", "--trials", "0"], "allowed is a whole number from 1 to 10000"),
        (["reproduce", "--seeds", "101"], "allowed is a whole number from 1 to 100"),
        (["reproduce", "--subject", "3"], "possible values: 1, 2, both"),
    ] {
        let output = cli::run(BINARY, folder.path(), &arguments);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(expected), "{text}");
    }
    assert!(cli::files(folder.path()).is_empty());
}

#[tokio::test]
async fn trials_that_failed_are_told_and_end_with_a_code_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    let solver = Analytic { panics: vec![2], ..Analytic::default() };
    let service = Service::start(&out.join("studies.db"), solver, 1).await;
    for muscles in [false, true] {
        let study = service.study(|new| (new.trial_budget, new.muscles) = (3, muscles)).await;
        service.wait_for(study, &[StudyState::Finished]).await;
    }
    service.stop().await;
    let arguments = ["reproduce", "--subject", "1", "--trials", "3", "--seeds", "1", "--folder", "out"];
    let output = cli::run(BINARY, folder.path(), &arguments);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    for variant in ["without", "with"] {
        let told =
            format!("gaitwright: subject 1, {variant} muscles, seed 1: 1 of 3 trials failed; the last, trial 2: ");
        assert!(text.contains(&told), "{text}");
    }
    assert!(out.join("report.html").exists());
}

#[test]
fn a_short_comparison_ends_in_a_report_that_stands_alone() {
    if std::env::var_os("GAITWRIGHT_LONG_TESTS").is_none() {
        eprintln!("skipped: set GAITWRIGHT_LONG_TESTS=1");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["reproduce", "--subject", "1", "--trials", "1", "--seeds", "1", "--folder", "out"];
    let first = cli::run(BINARY, folder.path(), &arguments);
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let report = read("report.html");
    assert!(report.contains("Subject 1, seed 1: Gait RMSE of the best action") && report.contains("<svg"));
    assert!(!report.contains("src=") && !report.contains("<link"), "nothing from elsewhere");
    assert_eq!(read("studies.csv").lines().count(), 3);
    assert_eq!(read("iterations.csv").lines().count(), 3);
    assert_eq!(read("angles.csv").lines().count(), 1 + 3 * 101);
    // What is finished is not done again, and comes to the same.
    let again = cli::run(BINARY, folder.path(), &arguments);
    assert_eq!(first.stdout, again.stdout);
    assert_eq!(report, read("report.html"));
}
