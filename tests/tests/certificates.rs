//! Certificates, conversions and references, through the command line and the service, with the real optimizer on a
//! coarse mesh.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_optimizer::Mesh;
use gait_optimizer::export::ControllerFile;
use gaitwright_service::workers::{GaitCertifier, GaitSolver};
use gaitwright_store::studies::{AnswerSource, Evaluation, StudyState};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{StudyId, events};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::cli;
use gaitwright_tests::described::audit_trail;
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
    let printed: Value = serde_json::from_str(&done(folder, &solve)).unwrap();
    assert_eq!(printed["status"], "converged");
    let certificate = &printed["certificate"];
    assert_eq!(certificate["passed"].as_bool(), Some(certificate["failures"].as_array().unwrap().is_empty()));
    assert!(certificate["return_map"]["largest"].as_f64().unwrap() < 1.0);

    // The same gait from a file of `solve --out`, and as downloaded from the service.
    let again: Value = serde_json::from_str(&done(folder, &["certify", "gait.json", "--json"])).unwrap();
    assert_eq!(&again, certificate);
    let outcome: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("gait.json")).unwrap()).unwrap();
    std::fs::write(folder.join("alone.json"), outcome["gait"].to_string()).unwrap();
    let text = done(folder, &["certify", "alone.json"]);
    assert!(text.starts_with("certificate: ") && text.contains("largest multiplier"), "{text}");
    let walker = "subject: 1.727 m, 65.7 kg; device: AMPRO3; without muscles";
    assert!(
        text.contains(walker)
            && text.contains("differs from the built-in problem: settings.mesh.ds2 is 2 (built-in: 4)"),
        "{text}"
    );

    // Figures that the file states are compared with those of its gait.
    for (figure, expected) in [
        ("cost_of_transport", "the file says that cost_of_transport is 0.01; the value computed from the gait is 0."),
        (
            "gait_rmse_rad",
            "the file says that gait_rmse_rad is 0.01; with the reference gait \"Falisse 2019, subject 1\" it is",
        ),
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
    let printed: Value = serde_json::from_str(&done(folder, &against)).unwrap();
    assert!(printed["gait_rmse_rad"].as_f64().unwrap() < 0.02, "{}", printed["gait_rmse_rad"]);

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
    refused(folder, &["convert", "gait.json", "--to", "mot", "--rate-hz", "0", "--out", "x.mot"], "--rate-hz is 0;");
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
            new.answer_source = AnswerSource::People;
            new.muscles = false;
            new.number_of_trials = 1;
            new.gait_settings.mesh = Mesh { ds2: 2, ds3: 2, ss2: 3, ss1: 5 };
        })
        .await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await.remove(0);
    let address = format!("/api/v1/trials/{}/certificate", trial.id);
    assert_eq!(service.fetch(&address).await.status, StatusCode::NOT_FOUND);
    let page = service.fetch(&format!("/trials/{}", trial.id)).await.text;
    let offers_or_makes = page.contains("Certify (takes a few seconds)") || page.contains("is being certified");
    assert!(page.contains("has no certificate yet") && offers_or_makes, "{page}");

    let motion = service.fetch(&format!("/api/v1/trials/{}/gait.mot?rate_hz=100", trial.id)).await;
    assert!(motion.text.contains("inDegrees=yes") && motion.text.contains("knee_angle_l"), "{}", motion.text);
    let early = service.fetch(&format!("/api/v1/trials/{}/controller.json", trial.id)).await;
    assert_eq!(early.status, StatusCode::CONFLICT, "{}", early.text);
    assert!(early.text.contains("request its certificate"), "{}", early.text);
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
    assert!(refused.text.contains("rate_hz") && !page.contains("/controller.json"), "{}", refused.text);

    let made = service.post(&address, &json!({})).await;
    assert_eq!(made.status, StatusCode::OK, "{}", made.text);
    assert_eq!(made.json()["result"], address, "{}", made.text);
    let certificate = certificate.json();
    assert_eq!(certificate["passed"].as_bool(), Some(certificate["failures"].as_array().unwrap().is_empty()));
    assert_eq!(service.fetch(&address).await.json(), certificate);
    let audit = service.fetch("/api/v1/audit").await.text;
    assert_eq!(["request_certificate", "trial.certify"].map(|act| audit.matches(act).count()), [1, 1], "{audit}");
    let page = service.fetch(&format!("/trials/{}", trial.id)).await.text;
    let word = if certificate["passed"] == true { ">passed<" } else { ">failed<" };
    assert!(page.contains(word) && page.contains("Largest Poincaré multiplier"), "{page}");
    assert!(page.contains("/controller.json"), "{page}");
    service.stop().await;
}

/// A study of one trial on a coarse mesh, with the real optimizer, and its trial.
async fn one_trial(service: &Service) -> (StudyId, Trial) {
    let study = service
        .study(|new| {
            (new.muscles, new.number_of_trials) = (false, 1);
            new.gait_settings.mesh = Mesh { ds2: 2, ds3: 2, ss2: 3, ss1: 5 };
        })
        .await;
    service.wait_for(study, &[StudyState::Finished]).await;
    (study, service.trials(study).await.remove(0))
}

/// Requests a report and waits for it.
async fn simulated(service: &Service, address: &str, asked: &Value) -> Value {
    let answer = service.post(address, asked).await;
    assert_eq!(answer.status, StatusCode::ACCEPTED, "{}", answer.text);
    let job = answer.headers["location"].to_str().unwrap().to_owned();
    while service.fetch(&job).await.json()["state"] != "done" {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert_eq!(service.fetch(&job).await.json()["result"], address);
    service.fetch(address).await.json()
}

#[tokio::test]
async fn service_simulates_the_walks_that_the_command_line_simulates() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start_certifying(&folder.path().join("a.db"), GaitSolver, GaitCertifier).await;
    let (study, trial) = one_trial(&service).await;
    let address = format!("/api/v1/trials/{}/execution-report", trial.id);
    let page = async || service.fetch(&format!("/trials/{}", trial.id)).await.text;
    // There is a recommendation as soon as the gait has a certificate.
    let recommended = async || loop {
        let found = service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await;
        if found.status == StatusCode::OK {
            return found.json();
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    };
    assert_eq!(service.fetch(&address).await.status, StatusCode::NOT_FOUND);
    let unknown = recommended().await;
    assert!(unknown["trial_id"] == json!(trial.id) && unknown["execution_report"].is_null(), "{unknown}");
    let before = page().await;
    assert!(before.contains("No simulated walks with this gait yet."), "{before}");
    for (wrong, field) in [
        (json!({"number_of_simulated_walks": 0}), "number_of_simulated_walks"),
        (json!({"number_of_simulated_walks": 1001}), "number_of_simulated_walks"),
        (json!({"seed": -1}), "seed"),
    ] {
        let refused = service.post(&address, &wrong).await;
        assert!(refused.status.is_client_error() && refused.text.contains(field), "{}", refused.text);
    }

    let found = simulated(&service, &address, &json!({"number_of_simulated_walks": 4, "seed": 3})).await;
    let report = &found["report"];
    let gait = service.fetch(&format!("/api/v1/trials/{}/gait", trial.id)).await.text;
    std::fs::write(folder.path().join("gait.json"), gait).unwrap();
    let printed = done(folder.path(), &["simulate", "gait.json", "--simulated-walks", "4", "--seed", "3", "--json"]);
    assert_eq!(*report, serde_json::from_str::<Value>(&printed).unwrap());
    let walks: Vec<&Value> =
        report["grounds"].as_array().unwrap().iter().map(|on| &on["number_of_simulated_walks"]).collect();
    assert_eq!(walks, [4, 4, 4]);

    // The page has the same without scripts, and the study page and the recommendation follow it.
    let shown = page().await;
    let level = format!("{} of 4 simulated walks on level ground", report["grounds"][0]["completed"]);
    assert!(found["sentence"].as_str().unwrap().starts_with(&level), "{}", found["sentence"]);
    let strides = format!("{} of 20", report["undisturbed_strides"]);
    for text in
        [found["sentence"].as_str().unwrap(), "ground uneven by ±10 mm", "seed 3", &strides, "/help/method#execution"]
    {
        assert!(shown.contains(text), "{text}: {shown}");
    }
    let of_study = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(of_study.contains(&level) && of_study.contains("#simulated-walks"), "{of_study}");
    assert_eq!(recommended().await["execution_report"], *report);

    // The same simulated walks exist; others replace them as the newest report, and the record keeps both.
    let again = service.post(&address, &json!({"number_of_simulated_walks": 4, "seed": 3})).await;
    assert_eq!((again.status, &again.json()["state"]), (StatusCode::OK, &json!("done")));
    let other = simulated(&service, &address, &json!({"number_of_simulated_walks": 4, "seed": 4})).await;
    assert_eq!((&other["report"]["seed"], other["report"]["grounds"] == report["grounds"]), (&json!(4), false));
    let audit = service.fetch("/api/v1/audit").await.text;
    assert_eq!(
        ["request_execution_report", "trial.report_execution"].map(|act| audit.matches(act).count()),
        [2, 2],
        "{audit}"
    );
    let events = events::after(&mut service.store.read().await.unwrap(), study, 0, 1000).await.unwrap();
    let events: Vec<_> = events.iter().filter(|event| event.kind == "execution_reported").collect();
    assert_eq!((events.len(), &events[0].payload["report"]), (2, report));
    let details = audit_trail(&service).await;
    assert!(
        ["passed", "failures", "number_of_simulated_walks"].iter().all(|name| details.contains(*name)),
        "{details:?}"
    );
    service.stop().await;
}

#[tokio::test]
async fn simulation_is_cancelled_and_a_requested_one_survives_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start_certifying(&database, GaitSolver, GaitCertifier).await;
    let (_, trial) = one_trial(&service).await;
    let address = format!("/api/v1/trials/{}/execution-report", trial.id);
    let job = format!("/api/v1/jobs/execution_report-{}", trial.id);
    let until = async |service: &Service, state: &str| {
        while service.fetch(&job).await.json()["state"] != state {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    let long = json!({"number_of_simulated_walks": 1000, "seed": 1});
    assert_eq!(service.post(&address, &long).await.status, StatusCode::ACCEPTED);
    until(&service, "running").await;
    let listed = service.fetch("/api/v1/jobs?kind=execution_report").await.items();
    assert_eq!((&listed[0]["trial_id"], listed[0]["progress"].is_number()), (&json!(trial.id), true), "{listed}");
    let page = service.fetch(&format!("/trials/{}", trial.id)).await.text;
    assert!(
        page.contains("1000 simulated walks on each kind of ground with seed 1 are running")
            && page.contains("<progress")
    );
    assert!(page.contains("followed_jobs.mjs") && !page.contains("/execution-report\""), "{page}");
    let other = service.post(&address, &json!({"number_of_simulated_walks": 2})).await;
    assert_eq!(other.status, StatusCode::CONFLICT, "{}", other.text);
    assert!(
        other.text.contains("(number of simulated walks: 1000, seed: 1) is already queued or running"),
        "{}",
        other.text
    );
    assert_eq!(service.post(&address, &long).await.status, StatusCode::ACCEPTED, "the same walks are the same job");
    assert_eq!(service.post(&format!("{job}/cancel"), &json!({})).await.json()["state"], "cancelled");
    until(&service, "cancelled").await;
    assert_eq!(service.fetch(&address).await.status, StatusCode::NOT_FOUND);

    assert_eq!(
        service.post(&address, &json!({"number_of_simulated_walks": 1000, "seed": 2})).await.status,
        StatusCode::ACCEPTED
    );
    until(&service, "running").await;
    service.stop().await;
    let service = Service::start_certifying(&database, GaitSolver, GaitCertifier).await;
    until(&service, "running").await;
    let page = service.fetch(&format!("/trials/{}", trial.id)).await.text;
    assert!(page.contains("1000 simulated walks on each kind of ground with seed 2"), "{page}");
    service.post(&format!("{job}/cancel"), &json!({})).await;
    service.stop().await;
    let service = Service::start_certifying(&database, GaitSolver, GaitCertifier).await;
    until(&service, "cancelled").await;
    assert_eq!(service.fetch(&address).await.status, StatusCode::NOT_FOUND);
    service.stop().await;
}

#[tokio::test]
async fn walks_with_a_gait_that_a_script_evaluated_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start_certifying(&folder.path().join("a.db"), GaitSolver, GaitCertifier).await;
    let script = service.study(|new| (new.evaluation, new.number_of_trials) = (Evaluation::Script, 2)).await;
    for outcome in
        [json!({"label": "converged", "gait_rmse_rad": 0.2}), json!({"label": "not_converged", "reason": "r"})]
    {
        let asked = service.post(&format!("/api/v1/studies/{script}/ask"), &json!({})).await.json();
        let trial = asked["id"].as_str().unwrap();
        service.post(&format!("/api/v1/trials/{trial}/tell"), &outcome).await;
        let walks = service.post(&format!("/api/v1/trials/{trial}/execution-report"), &json!({})).await;
        let sensitivities = service.fetch(&format!("/api/v1/trials/{trial}/sensitivities")).await;
        for refused in [walks, sensitivities] {
            assert_eq!(refused.status, StatusCode::CONFLICT, "{}", refused.text);
            let reasons = ["was evaluated by a script", "the state \u{201c}not converged\u{201d}"];
            assert!(reasons.iter().any(|reason| refused.text.contains(reason)), "{}", refused.text);
        }
        let page = service.fetch(&format!("/trials/{trial}?sensitivities=true")).await.text;
        assert_eq!(
            page.contains("so its gait is not stored here and sensitivities cannot be computed"),
            outcome["label"] == "converged"
        );
    }
    service.stop().await;
}

#[tokio::test]
async fn sensitivities_of_a_mesh_above_80_intervals_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    for (ss1, refused) in [(20, false), (21, true)] {
        let mesh = Mesh { ds2: 20, ds3: 20, ss2: 20, ss1 };
        let study = service.study(|new| (new.gait_settings.mesh, new.number_of_trials) = (mesh, 1)).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let trial = service.trials(study).await.remove(0);
        assert_eq!(trial.state, TrialState::Converged);
        let answer = service.fetch(&format!("/api/v1/trials/{}/sensitivities", trial.id)).await;
        assert_eq!(
            answer.status,
            StatusCode::CONFLICT,
            "an analytic gait has no solution of its mesh: {}",
            answer.text
        );
        let reason = format!(
            "The mesh of trial 1 has {} intervals. The service computes sensitivities for at most 80 intervals;",
            60 + ss1
        );
        assert_eq!(answer.text.contains(&reason), refused, "{}", answer.text);
    }
    service.stop().await;
}

#[tokio::test]
async fn service_has_the_sensitivities_that_the_command_line_prints() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), GaitSolver, 1).await;
    let (_, trial) = one_trial(&service).await;
    let found = service.fetch(&format!("/api/v1/trials/{}/sensitivities", trial.id)).await;
    assert_eq!(found.status, StatusCode::OK, "{}", found.text);
    let problem = service.fetch(&format!("/api/v1/trials/{}/problem.json", trial.id)).await.text;
    std::fs::write(folder.path().join("problem.json"), problem).unwrap();
    let solve = ["solve", "--problem", "problem.json", "--sensitivities"];
    let text = done(folder.path(), &solve);
    let printed: Value = serde_json::from_str(&done(folder.path(), &[&solve[..], &["--json"]].concat())).unwrap();

    let found = found.json();
    let bounds = found["bounds"].as_array().unwrap();
    assert_eq!(found["cost_of_transport"], printed["sensitivities"]["cost_of_transport"]);
    assert_eq!(found["cost_of_transport"], printed["cost_of_transport"]);
    let mut steps = 0;
    for (bound, printed) in bounds.iter().zip(printed["sensitivities"]["bounds"].as_array().unwrap()) {
        for (field, value) in printed.as_object().unwrap() {
            assert_eq!(bound[field], *value, "{field} of {}", bound["bound"]);
        }
        let step = &bound["grid_step"];
        let change = step["to"].as_f64().unwrap() - bound["value"].as_f64().unwrap();
        let expected = change * bound["derivatives"]["gait_rmse_rad"].as_f64().unwrap();
        assert_eq!(step["gait_rmse_rad"].as_f64().unwrap(), expected);
        steps += 1;
    }
    assert_eq!(steps, 8);
    assert!(bounds.iter().any(|bound| bound["active"].as_array().unwrap().is_empty()));
    assert!(bounds.iter().any(|bound| bound["derivatives"]["cost_of_transport"].as_f64().unwrap() != 0.0));
    let page = service.fetch(&format!("/trials/{}?sensitivities=true", trial.id)).await.text;
    let sentences = found["sentences"].as_array().unwrap();
    assert!(sentences.len() > 1);
    for sentence in sentences {
        let sentence = sentence.as_str().unwrap();
        assert!(text.contains(sentence), "{sentence}: {text}");
        // Pages have degrees, so that values and changes per unit differ.
        let angles = sentence.contains("rad/s") || sentence.contains(" rad less") || sentence.contains(" rad more");
        let shown = if angles { sentence.split_once(':').unwrap().0 } else { sentence };
        let places = sentence.split_once("Active at ").map_or("", |(_, rest)| rest.split_once(". ").unwrap().0);
        assert!(page.contains(shown) && page.contains(places), "{sentence}: {page}");
    }
    service.stop().await;
}

#[tokio::test]
async fn command_line_repeats_the_solve_of_a_trial_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), GaitSolver, 1).await;
    let study = service
        .study(|new| {
            (new.muscles, new.number_of_trials) = (false, 2);
            new.gait_settings.mesh = Mesh { ds2: 2, ds3: 2, ss2: 3, ss1: 5 };
        })
        .await;
    service.wait_for(study, &[StudyState::Finished]).await;
    for trial in service.trials(study).await {
        let file = format!("problem-trial-{}.json", trial.number);
        let address = format!("/api/v1/trials/{}/problem.json", trial.id);
        let page = service.fetch(&format!("/trials/{}", trial.id)).await.text;
        assert!(page.contains(&format!("href=\"{address}\" download")), "{page}");
        let problem = service.fetch(&address).await;
        assert!(problem.headers["content-disposition"].to_str().unwrap().contains(&file));
        assert_eq!(problem.json()["warm_start"].is_object(), trial.warm_started_from.is_some());
        std::fs::write(folder.path().join(&file), &problem.text).unwrap();
        let printed = done(folder.path(), &["solve", "--problem", &file, "--json"]);
        let printed: Value = serde_json::from_str(&printed).unwrap();
        let report = serde_json::to_value(trial.report.unwrap()).unwrap();
        for same in ["status", "started_from", "iterations", "objective", "gait_rmse_rad", "max_violation"] {
            assert_eq!(printed[same], report[same], "trial {}: {same}", trial.number);
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
