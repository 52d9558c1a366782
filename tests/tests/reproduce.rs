//! The paper's comparison through the command line: minutes of solving, so only with `GAITWRIGHT_LONG_TESTS=1`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gait_optimizer::ReferenceGait;
use gaitwright_store::studies::StudyState;
use gaitwright_store::{commit, reference_gaits};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::cli;
use gaitwright_tests::service::Service;
use skipped_tests::long_tests_are_skipped;
use std::time::Duration;

const BINARY: &str = env!("CARGO_BIN_EXE_gaitwright-cli");

#[test]
fn invalid_arguments_are_refused_before_the_first_solve() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, expected) in [
        (["reproduce", "--trials", "0"], "must be a whole number from 1 to 10000"),
        (["reproduce", "--seeds", "101"], "must be a whole number from 1 to 100"),
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
async fn failed_trials_are_reported_with_their_own_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    let solver = Analytic { panics: vec![2], ..Analytic::default() };
    let service = Service::start(&out.join("studies.db"), solver, 1).await;
    for muscles in [false, true] {
        let study = service
            .study(|new| (new.number_of_trials, new.muscles, new.repeat_results) = (3, muscles, Some(true)))
            .await;
        service.wait_for(study, &[StudyState::Finished]).await;
    }
    service.stop().await;
    let arguments = ["reproduce", "--subject", "1", "--trials", "3", "--seeds", "1", "--folder", "out"];
    let output = cli::run(BINARY, folder.path(), &arguments);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    for variant in ["without", "with"] {
        let told = format!("gaitwright: subject 1, {variant} muscles, seed 1: trial 2 of 3 failed: ");
        assert!(text.contains(&told), "{text}");
    }
    assert!(out.join("report.html").exists());
}

#[tokio::test]
async fn report_has_a_deviation_band_or_states_that_it_has_none() {
    let folder = tempfile::tempdir().unwrap();
    let plain = ReferenceGait { standard_deviation_rad: None, ..ReferenceGait::builtin().unwrap() };
    std::fs::write(folder.path().join("plain.json"), serde_json::to_string(&plain).unwrap()).unwrap();
    // The built-in reference has a band.
    for (out, reference) in [("plain", Some(&plain)), ("band", None)] {
        std::fs::create_dir(folder.path().join(out)).unwrap();
        let service = Service::start(&folder.path().join(out).join("studies.db"), Analytic::default(), 1).await;
        let mut id = None;
        if let Some(reference) = reference {
            let mut writer = service.store.write().await.unwrap();
            id = Some(reference_gaits::ensure(&mut writer, reference).await.unwrap().0.id);
            commit(writer).await.unwrap();
        }
        for muscles in [false, true] {
            let study = service
                .study(|new| {
                    (new.number_of_trials, new.muscles, new.reference_gait_id) = (3, muscles, id);
                    new.repeat_results = Some(true);
                })
                .await;
            service.wait_for(study, &[StudyState::Finished]).await;
            let recommended = format!("/api/v1/studies/{study}/recommendation");
            for _ in 0..500 {
                if service.fetch(&recommended).await.json()["certificate"] == "passed" {
                    break;
                }
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        }
        service.stop().await;
        let arguments = ["reproduce", "--subject", "1", "--trials", "3", "--seeds", "1", "--folder", out];
        let given: &[&str] = if id.is_some() { &["--reference", "plain.json"] } else { &[] };
        let output = cli::run(BINARY, folder.path(), &[&arguments[..], given].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let read = |name: &str| std::fs::read_to_string(folder.path().join(out).join(name)).unwrap();
        let (report, angles) = (read("report.html"), read("angles.csv"));
        assert_eq!(report.matches("</i>one standard deviation").count(), if id.is_some() { 0 } else { 5 });
        assert_eq!(report.contains("so there is no band"), id.is_some());
        assert!(report.contains("measured against the reference gait Falisse 2019, subject 1"), "{report}");
        // The service of this test passed them.
        assert!(report.contains("2 of 2 best gaits passed certification"), "{report}");
        assert!(
            report.contains("Subject 1: Gait RMSE of the best action is lower with muscles")
                && report.contains("1.58 against 1.80")
        );
        assert_eq!(angles.matches("reference standard deviation,,,").count(), if id.is_some() { 0 } else { 101 });
    }
}

#[test]
fn short_comparison_writes_a_self_contained_report() {
    if long_tests_are_skipped("") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["reproduce", "--subject", "1", "--trials", "1", "--seeds", "1", "--folder", "out"];
    let first = cli::run(BINARY, folder.path(), &arguments);
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let report = read("report.html");
    assert!(report.contains("<h2>Subject 1, seed 1</h2>") && report.contains("<h4>Gait RMSE of the best action</h4>"));
    assert_eq!(report.matches("class=\"tiles\"").count(), 2, "the strides of both gaits");
    assert!(report.contains("<h4>Right ankle</h4>"), "an orbit of every joint");
    assert!(!report.contains("src=") && !report.contains("<link"), "nothing from elsewhere");
    assert_eq!(read("studies.csv").lines().count(), 3);
    assert_eq!(read("iterations.csv").lines().count(), 3);
    assert_eq!(read("angles.csv").lines().count(), 1 + 4 * 101);
    // Finished studies are not repeated, and the results are the same.
    let again = cli::run(BINARY, folder.path(), &arguments);
    assert_eq!(first.stdout, again.stdout);
    assert_eq!(report, read("report.html"));
}
