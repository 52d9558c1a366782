//! Setting the clock back does not change the order of rows. This test has its own process, because the clock belongs
//! to the process.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright_store::set_machine_clock;
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::TrialState;
use gaitwright_tests::cli;
use gaitwright_tests::service::Service;
use gaitwright_tests::well_formed::WellFormed;
use serde_json::json;

#[tokio::test]
async fn report_after_a_review_applies_although_the_clock_was_set_back() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start(&database, WellFormed::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 6).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let trial = trials.iter().find(|trial| trial.state == TrialState::Converged).unwrap().id;
    let report = format!("/api/v1/trials/{trial}/safety-reports");
    let review = format!("/api/v1/trials/{trial}/safety-reviews");
    let controller = format!("/api/v1/trials/{trial}/controller.json");
    let walkable = json!({"decision": "cleared", "reason": "seen again"});
    set_machine_clock(3600);
    assert_eq!(service.post(&report, &json!({})).await.status, StatusCode::CREATED);
    assert_eq!(service.post(&review, &walkable).await.status, StatusCode::CREATED);
    assert_eq!(service.fetch(&controller).await.status, StatusCode::OK);
    set_machine_clock(0);
    assert_eq!(service.post(&report, &json!({})).await.status, StatusCode::CREATED);
    assert_eq!(service.fetch(&controller).await.status, StatusCode::CONFLICT);
    let reports = service.fetch(&format!("/api/v1/studies/{study}/safety-reports")).await.items();
    assert_eq!((&reports[0]["in_force"], &reports[1]["in_force"]), (&json!(false), &json!(true)), "{reports}");
    service.stop().await;
    // The record has rows of an hour ahead, and nobody has signed in.
    let doctor = ["doctor", "--database", "a.db", "--listen", "127.0.0.1:0"];
    let output = cli::run(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), &doctor);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("error   clock") && text.contains("the clock was set back"), "{text}");
}
