//! Certificates, conversions and references, through the command line and the service, with the real optimizer on a
//! coarse mesh.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_optimizer::Mesh;
use gait_optimizer::export::ControllerFile;
use gaitwright_service::workers::{GaitCertifier, GaitSolver};
use gaitwright_store::studies::{FeedbackMode, StudyState};
use gaitwright_tests::cli;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};
use std::path::Path;
use std::time::Duration;

const BINARY: &str = env!("CARGO_BIN_EXE_gaitwright-cli");

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = cli::run(BINARY, folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn refused(folder: &Path, arguments: &[&str], expected: &str) {
    let before = cli::files(folder);
    let output = cli::run(BINARY, folder, arguments);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains(expected), "{text}");
    assert!(output.stdout.is_empty());
    assert_eq!(cli::files(folder), before, "something was left behind");
}

#[test]
fn commands_solve_certify_and_convert_a_gait() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let solve = ["solve", "--muscles", "off", "--mesh", "2,2,3,5", "--certify", "--json", "--out", "gait.json"];
    let figures: Value = serde_json::from_str(&done(folder, &solve)).unwrap();
    assert_eq!(figures["status"], "converged");
    let certificate = &figures["certificate"];
    assert_eq!(certificate["passed"].as_bool(), Some(certificate["failures"].as_array().unwrap().is_empty()));
    assert!(certificate["return_map"]["largest"].as_f64().unwrap() < 1.0);

    // The same gait from a file of `solve --out`, and as downloaded from the service.
    let again: Value = serde_json::from_str(&done(folder, &["certify", "gait.json", "--json"])).unwrap();
    assert_eq!(&again, certificate);
    let outcome: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("gait.json")).unwrap()).unwrap();
    std::fs::write(folder.join("alone.json"), outcome["gait"].to_string()).unwrap();
    let text = done(folder, &["certify", "alone.json"]);
    assert!(text.starts_with("certificate: ") && text.contains("largest multiplier"), "{text}");
    let walker = "subject of 1.727 m and 65.7 kg, device \"AMPRO3\", without muscles";
    assert!(text.contains(walker) && text.contains("differs: settings.mesh.ds2 is 2 (built-in: 4)"), "{text}");

    // Figures that the file states are compared with those of its gait.
    for (figure, expected) in [
        ("cost_of_transport", "it states cost_of_transport as 0.01; computed from the gait it is 0."),
        ("gait_rmse_rad", "it states gait_rmse_rad as 0.01; with the reference gait \"Falisse 2019, subject 1\" it is"),
    ] {
        let mut forged = outcome.clone();
        forged["report"][figure] = json!(0.01);
        std::fs::write(folder.join("forged.json"), forged.to_string()).unwrap();
        refused(folder, &["certify", "forged.json"], expected);
    }
    std::fs::remove_file(folder.join("forged.json")).unwrap();

    done(folder, &["convert", "alone.json", "--to", "mot", "--rate-hz", "1000", "--out", "gait.mot"]);
    let end = outcome["gait"]["stride_time_s"].as_f64().unwrap() - 1e-6;
    let strikes = format!("0,{end}");
    let reference = ["reference", "gait.mot", "--name", "our own", "--heel-strikes-s", &strikes, "--out", "own.json"];
    done(folder, &reference);
    // The Gait RMSE of a gait against itself is only the error of interpolation.
    let warm = ["--warm", "gait.json", "--mesh", "2,2,3,5", "--muscles", "off", "--json"];
    let against = [&["solve", "--reference", "own.json"][..], &warm].concat();
    let figures: Value = serde_json::from_str(&done(folder, &against)).unwrap();
    assert!(figures["gait_rmse_rad"].as_f64().unwrap() < 0.02, "{}", figures["gait_rmse_rad"]);

    let table = done(folder, &["convert", "gait.json", "--to", "csv"]);
    let mut rows = table.lines();
    assert!(rows.next().unwrap().starts_with("time_s,domain,px_m,pz_m,torso_rad,"), "{table}");
    assert!(rows.clone().count() > 20 && rows.all(|row| row.split(',').count() == 34 && !row.contains("NaN")));

    // A gait outside a record may have been reported as unsafe, so it has no controller file.
    refused(folder, &["convert", "gait.json", "--to", "controller"], "invalid value 'controller'");
    let tiles = done(folder, &["convert", "gait.json", "--to", "tiles"]);
    assert!(tiles.starts_with("<svg") && tiles.contains(">100 %</text>"), "{tiles}");
    let animation = done(folder, &["convert", "gait.json", "--to", "animation"]);
    assert!(animation.starts_with("<svg") && animation.contains("repeatCount=\"indefinite\""), "{animation}");
    assert!(!animation.contains("NaN") && !animation.contains("var(--"), "{animation}");
    refused(folder, &["convert", "gait.json", "--to", "mot", "--rate-hz", "0", "--out", "x.mot"], "rate_hz is 0;");
    let mut broken = outcome["gait"].clone();
    broken["domains"].as_array_mut().unwrap().pop();
    std::fs::write(folder.join("broken.json"), broken.to_string()).unwrap();
    refused(folder, &["certify", "broken.json"], "number of domains is 7; it must be 8.");
}

#[test]
fn files_other_than_gaits_and_recordings_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    refused(folder, &["certify", "nowhere.json"], "Cannot read nowhere.json");
    std::fs::write(folder.join("list.json"), "[1, 2]").unwrap();
    refused(folder, &["certify", "list.json"], "list.json is not a gait file");
    refused(folder, &["convert", "list.json", "--to", "csv"], "list.json is not a gait file");
    let times_s: Vec<String> = (0..30).map(|row| row.to_string()).collect();
    std::fs::write(folder.join("walk.mot"), format!("walk\nendheader\ntime\n{}\n", times_s.join("\n"))).unwrap();
    let reference = ["reference", "walk.mot", "--name", "x", "--out", "r.json"];
    refused(
        folder,
        &reference,
        "walk.mot, line 2: the header has neither inDegrees=yes nor inDegrees=no; give the unit",
    );
    refused(folder, &["solve", "--reference", "list.json"], "list.json is not a reference gait");
}

#[tokio::test]
async fn trial_is_certified_once() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start_certifying(&folder.path().join("a.db"), GaitSolver, GaitCertifier).await;
    let study = service
        .study(|new| {
            new.feedback_mode = FeedbackMode::Human;
            new.muscles = false;
            new.trial_budget = 1;
            new.gait_settings.mesh = Mesh { ds2: 2, ds3: 2, ss2: 3, ss1: 5 };
        })
        .await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await.remove(0);
    let address = format!("/api/v1/trials/{}/certificate", trial.id);
    assert_eq!(service.fetch(&address).await.status, StatusCode::NOT_FOUND);
    let page = service.fetch(&format!("/trials/{}", trial.id)).await.text;
    assert!(page.contains("has no certificate yet") && page.contains("Certify (takes a few seconds)"), "{page}");

    let motion = service.fetch(&format!("/api/v1/trials/{}/gait.mot?rate_hz=100", trial.id)).await;
    assert!(motion.text.contains("inDegrees=yes") && motion.text.contains("knee_angle_l"), "{}", motion.text);
    let early = service.fetch(&format!("/api/v1/trials/{}/controller.json", trial.id)).await;
    assert_eq!(early.status, StatusCode::CONFLICT, "{}", early.text);
    assert!(early.text.contains(&format!("POST {address}")), "{}", early.text);
    let asked = service.post(&address, &json!({})).await;
    assert_eq!(asked.status, StatusCode::ACCEPTED, "{}", asked.text);
    let job = asked.headers["location"].to_str().unwrap().to_owned();
    while service.fetch(&job).await.json()["state"] != "done" {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let certificate = service.fetch(&address).await;
    assert_eq!(certificate.status, StatusCode::OK, "{}", certificate.text);
    let controller = service.fetch(&format!("/api/v1/trials/{}/controller.json", trial.id)).await;
    assert_eq!(controller.json()["certificate_passed"], certificate.json()["passed"]);
    assert_eq!(ControllerFile::from_json(&controller.text).unwrap().domains.len(), 8);
    assert!(controller.headers["content-disposition"].to_str().unwrap().contains("controller-trial-1.json"));
    let refused = service.fetch(&format!("/api/v1/trials/{}/controller.json?rate_hz=1", trial.id)).await;
    assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", refused.text);
    assert!(refused.text.contains("rate_hz") && page.contains("/controller.json"), "{}", refused.text);

    let made = service.post(&address, &json!({})).await;
    assert_eq!(made.status, StatusCode::OK, "{}", made.text);
    assert_eq!(made.json()["result"], address, "{}", made.text);
    let certificate = certificate.json();
    assert_eq!(certificate["passed"].as_bool(), Some(certificate["failures"].as_array().unwrap().is_empty()));
    assert_eq!(service.fetch(&address).await.json(), certificate);
    let audit = service.fetch("/api/v1/audit").await.text;
    assert_eq!(["ask_certificate", "trial.certify"].map(|act| audit.matches(act).count()), [1, 1], "{audit}");
    let page = service.fetch(&format!("/trials/{}", trial.id)).await.text;
    let word = if certificate["passed"] == true { ">passed<" } else { ">failed<" };
    assert!(page.contains(word) && page.contains("Largest Poincaré multiplier"), "{page}");
    service.stop().await;
}

#[tokio::test]
async fn command_line_repeats_the_solve_of_a_trial_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), GaitSolver, 1).await;
    let study = service
        .study(|new| {
            (new.muscles, new.trial_budget) = (false, 2);
            new.gait_settings.mesh = Mesh { ds2: 2, ds3: 2, ss2: 3, ss1: 5 };
        })
        .await;
    service.wait_for(study, &[StudyState::Finished]).await;
    for trial in service.trials(study).await {
        let file = format!("problem-trial-{}.json", trial.number);
        let address = format!("/api/v1/trials/{}/problem.json", trial.id);
        let page = service.fetch(&format!("/trials/{}", trial.id)).await.text;
        assert!(page.contains(&format!("href=\"{address}\" download=\"{file}\"")), "{page}");
        let problem = service.fetch(&address).await;
        assert!(problem.headers["content-disposition"].to_str().unwrap().contains(&file));
        assert_eq!(problem.json()["warm_start"].is_object(), trial.warm_started_from.is_some());
        std::fs::write(folder.path().join(&file), &problem.text).unwrap();
        let figures = done(folder.path(), &["solve", "--problem", &file, "--json"]);
        let figures: Value = serde_json::from_str(&figures).unwrap();
        let report = serde_json::to_value(trial.report.unwrap()).unwrap();
        for same in ["status", "started_from", "iterations", "objective", "gait_rmse_rad", "max_violation"] {
            assert_eq!(figures[same], report[same], "trial {}: {same}", trial.number);
        }
        let mut wrong = problem.json();
        wrong["problem"]["subject"]["height_m"] = json!(9.0);
        std::fs::write(folder.path().join("wrong.json"), wrong.to_string()).unwrap();
        refused(folder.path(), &["solve", "--problem", "wrong.json"], "height_m");
        let both = ["solve", "--problem", &file, "--muscles", "off"];
        refused(folder.path(), &both, "cannot be used with");
    }
    service.stop().await;
}
