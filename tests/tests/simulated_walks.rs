//! Studies with simulated walks: reports, ties in Gait RMSE, and gaits that are not executable, with the real optimiser on
//! a coarse mesh.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_optimizer::{CancelToken, IterationRecord, SolveOutcome};
use gaitwright_service::workers::{Assignment, Evaluate, GaitCertifier, GaitSolver};
use gaitwright_store::feedback::{FeedbackContent, Source};
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Store, StudyId, execution_reports};
use gaitwright_tests::service::Service;
use gaitwright_tests::{archives, cli};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

const BINARY: &str = env!("CARGO_BIN_EXE_gaitwright-cli");
const SEED: u64 = 5;

/// The body of a request for a study with simulated walks.
async fn body(service: &Service, walks: &Value) -> Value {
    json!({
        "subject_id": service.subject().await, "muscles": false, "number_of_trials": 3, "seed": SEED,
        "gait_settings": {"mesh": {"ds2": 2, "ds3": 2, "ss2": 3, "ss1": 5}}, "simulated_walks": walks,
    })
}

async fn created(service: &Service, walks: &Value) -> StudyId {
    let answer = service.post("/api/v1/studies", &body(service, walks).await).await;
    assert_eq!(answer.status, StatusCode::CREATED, "{}", answer.text);
    let study = answer.json();
    let setting = &study["simulated_walks"];
    assert!(walks.as_object().unwrap().iter().all(|(name, value)| setting[name] == *value), "{study}");
    service.scheduler.changed();
    study["id"].as_str().unwrap().parse().unwrap()
}

async fn finished(service: &Service, walks: &Value) -> (StudyId, Vec<Trial>) {
    let study = created(service, walks).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    (study, service.trials(study).await)
}

/// The mean strides of the newest report of a trial, which must have the seed of the study.
async fn reported(store: &Store, trial: &Trial) -> Option<f64> {
    let kept = execution_reports::newest(&mut store.read().await.unwrap(), trial.id).await.unwrap()?;
    assert_eq!(kept.reported.seed, SEED);
    Some(kept.reported.report.mean_strides())
}

/// Number, action, state, Gait RMSE and mean strides of a trial.
type Found = (u32, u64, TrialState, Option<f64>, Option<f64>);

/// Results of a study, without identifiers and times.
fn results(trials: &[Trial]) -> Vec<Found> {
    let of = |trial: &Trial| (trial.number, trial.action_index.0, trial.state, trial.gait_rmse_rad, trial.mean_strides);
    trials.iter().map(of).collect()
}

#[tokio::test]
async fn setting_is_off_by_default_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), GaitSolver, 1).await;
    let mut draft = body(&service, &json!({})).await;
    draft["start"] = json!(false);
    let study = service.post("/api/v1/studies", &draft).await.json();
    let expected = json!({"effect": "none", "number_of_simulated_walks": 50, "gait_rmse_tolerance_rad": 0.05, "least_mean_strides": 3.0});
    assert_eq!(study["simulated_walks"], expected);
    for (change, field) in [
        (json!({"simulated_walks": {"number_of_simulated_walks": 0}}), "simulated_walks.number_of_simulated_walks"),
        (json!({"simulated_walks": {"number_of_simulated_walks": 1001}}), "simulated_walks.number_of_simulated_walks"),
        (json!({"simulated_walks": {"gait_rmse_tolerance_rad": -0.1}}), "simulated_walks.gait_rmse_tolerance_rad"),
        (json!({"simulated_walks": {"least_mean_strides": 20.5}}), "simulated_walks.least_mean_strides"),
        (json!({"simulated_walks": {"effect": "certify"}}), "certify"),
        (json!({"simulated_walks": {"effect": "report"}, "evaluation": "script"}), "simulated_walks.effect"),
        (json!({"simulated_walks": {"effect": "tie_break"}, "answer_source": "people"}), "simulated_walks.effect"),
    ] {
        let mut wrong = draft.clone();
        wrong.as_object_mut().unwrap().extend(change.as_object().unwrap().clone());
        let refused = service.post("/api/v1/studies", &wrong).await;
        assert!(refused.status.is_client_error() && refused.text.contains(field), "{change}: {}", refused.text);
    }
    service.stop().await;
}

#[tokio::test]
async fn reports_follow_the_solves_of_a_study_that_they_do_not_change_even_after_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    // Without jobs after solves, the requests stay on record.
    let service = Service::start_without_certificates(&database, GaitSolver).await;
    let (_, without) = finished(&service, &json!({})).await;
    let (_, trials) = finished(&service, &json!({"effect": "report", "number_of_simulated_walks": 1})).await;
    assert_eq!(results(&trials), results(&without));
    assert_eq!(reported(&service.store, &trials[0]).await, None);
    service.stop().await;

    let service = Service::start_certifying(&database, GaitSolver, GaitCertifier).await;
    for trial in trials.iter().filter(|trial| trial.state == TrialState::Converged) {
        while reported(&service.store, trial).await.is_none() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
    assert_eq!(reported(&service.store, &without[0]).await, None);
    // A new study gets its reports without a restart.
    let (_, trials) = finished(&service, &json!({"effect": "report", "number_of_simulated_walks": 1})).await;
    let last = trials.iter().rfind(|trial| trial.state == TrialState::Converged).unwrap();
    while reported(&service.store, last).await.is_none() {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    service.stop().await;
}

#[tokio::test]
async fn mean_strides_decide_between_gaits_within_the_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), GaitSolver, 1).await;
    let walks = json!({"effect": "tie_break", "number_of_simulated_walks": 1, "gait_rmse_tolerance_rad": 10.0});
    let (study, trials) = finished(&service, &walks).await;
    let of = |id| trials.iter().find(|trial| trial.id == id).unwrap();
    let mut decided = 0;
    for row in service.feedback(study).await.iter().filter(|row| row.source == Source::GaitRmse) {
        let FeedbackContent::Preference { winner, loser } = row.content else { continue };
        let [most, least] = [winner, loser].map(|id| of(id).mean_strides.unwrap());
        assert!(most >= least, "{row:?}");
        assert_eq!(most > least, row.note.contains("simulated walks decide"), "{row:?}");
        decided += u32::from(most > least);
    }
    assert!(decided > 0, "no comparison was decided by simulated walks");
    for trial in trials.iter().filter(|trial| trial.state == TrialState::Converged) {
        assert_eq!(reported(&service.store, trial).await, trial.mean_strides);
    }
    let answers = service.fetch(&format!("/api/v1/studies/{study}/preferences")).await.text;
    assert!(answers.contains("less than the tolerance of 10 rad"), "{answers}");

    // The computed answers of an archive are checked by the same rule.
    let archive = archives::exported(&service.store, study).await;
    let other = Service::start(&folder.path().join("b.db"), GaitSolver, 1).await;
    archives::import(&other.store, &archive).await.unwrap();
    other.stop().await;
    service.stop().await;
}

#[tokio::test]
async fn gaits_with_too_few_strides_are_labelled_and_never_recommended() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), GaitSolver, 1).await;
    let walks = json!({"effect": "label", "number_of_simulated_walks": 1, "least_mean_strides": 20.0});
    let (study, trials) = finished(&service, &walks).await;
    for trial in trials.iter().filter(|trial| trial.state.has_gait()) {
        let strides = trial.mean_strides.unwrap();
        let expected = if strides < 20.0 { TrialState::NotExecutable } else { TrialState::Converged };
        assert_eq!((trial.state, reported(&service.store, trial).await), (expected, Some(strides)));
    }
    let trial = trials.iter().find(|trial| trial.state == TrialState::NotExecutable).expect("a gait that falls");
    assert!(trial.message.contains("fewer than the minimum of 20 for an executable gait"), "{}", trial.message);
    assert!(trials.iter().all(|trial| trial.state != TrialState::Converged), "{:?}", results(&trials));

    let shown = service.fetch(&format!("/api/v1/trials/{}", trial.id)).await.json();
    assert_eq!((&shown["state"], &shown["mean_strides"]), (&json!("not_executable"), &json!(trial.mean_strides)));
    assert!(shown["gait_rmse_rad"].is_number(), "{shown}");
    for (address, text) in [
        (format!("/trials/{}", trial.id), "not executable"),
        (format!("/studies/{study}"), "not executable"),
        (format!("/api/v1/studies/{study}/trials.csv"), "not_executable"),
        (format!("/api/v1/studies/{study}"), "\"not_executable\":"),
    ] {
        let answer = service.fetch(&address).await;
        assert!(answer.status == StatusCode::OK && answer.text.contains(text), "{address}: {}", answer.text);
    }
    for address in [format!("studies/{study}/recommendation"), format!("trials/{}/controller.json", trial.id)] {
        let answer = service.fetch(&format!("/api/v1/{address}")).await;
        assert_eq!(answer.status, StatusCode::CONFLICT, "{address}: {}", answer.text);
    }
    let labels = service.feedback(study).await;
    assert!(labels.iter().all(|row| matches!(row.content, FeedbackContent::Label { .. })), "{labels:?}");

    let archive = archives::exported(&service.store, study).await;
    let other = Service::start(&folder.path().join("b.db"), GaitSolver, 1).await;
    archives::import(&other.store, &archive).await.unwrap();
    other.stop().await;
    service.stop().await;
}

/// Counts the solves that have ended.
struct Counted(Arc<AtomicU32>);

impl Evaluate for Counted {
    fn evaluate(
        &self,
        assignment: &Assignment,
        observer: &mut dyn FnMut(&IterationRecord),
        cancel: &CancelToken,
    ) -> Result<SolveOutcome, String> {
        let outcome = GaitSolver.evaluate(assignment, observer, cancel);
        self.0.fetch_add(1, Ordering::SeqCst);
        outcome
    }
}

#[tokio::test]
async fn result_waits_for_its_walks_and_does_not_depend_on_restarts_or_workers() {
    let folder = tempfile::tempdir().unwrap();
    let walks = json!({"effect": "label", "number_of_simulated_walks": 10, "least_mean_strides": 2.5});
    let service = Service::start(&folder.path().join("a.db"), GaitSolver, 3).await;
    let (_, expected) = finished(&service, &walks).await;
    service.stop().await;

    let database = folder.path().join("b.db");
    let solved = Arc::new(AtomicU32::new(0));
    let service = Service::start(&database, Counted(Arc::clone(&solved)), 1).await;
    let study = created(&service, &walks).await;
    while solved.load(Ordering::SeqCst) == 0 {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    let trials = service.trials(study).await;
    assert_eq!((trials.len(), trials[0].state), (1, TrialState::Running), "the result waits for its walks");
    service.stop().await;

    let service = Service::start_as_is(&database, Counted(Arc::clone(&solved)), 1).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    assert_eq!(results(&trials), results(&expected));
    assert_eq!(solved.load(Ordering::SeqCst) as usize, trials.len() + 1, "the interrupted trial is solved again");
    service.stop().await;
}

#[test]
fn command_tunes_with_simulated_walks() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("coarse.json"), r#"{"mesh": {"ds2": 2, "ds3": 2, "ss2": 3, "ss1": 5}}"#).unwrap();
    let study = ["tune", "--muscles", "off", "--trials", "3", "--workers", "1", "--settings", "coarse.json", "--json"];
    let tuned = |more: &[&str]| {
        let output = cli::run(BINARY, folder, &[&study[..], more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<Value>(&output.stdout).unwrap()
    };
    let reported = tuned(&["--database", "a.db", "--simulated-walks-effect", "report", "--simulated-walks", "2"]);
    assert_eq!(reported["best_simulated_walks"]["number_of_simulated_walks"], json!(6), "{reported}");
    assert!(reported["trials"][0]["mean_strides"].is_null(), "{reported}");
    let labelled = tuned(&[
        "--database",
        "b.db",
        "--simulated-walks-effect",
        "label",
        "--simulated-walks",
        "2",
        "--least-mean-strides",
        "20",
    ]);
    assert!(labelled["best_trial"].is_null() && labelled["trials"][0]["state"] == "not_executable", "{labelled}");

    let alone = cli::run(BINARY, folder, &[&study[..], &["--database", "c.db", "--simulated-walks", "2"]].concat());
    let text = String::from_utf8_lossy(&alone.stderr);
    assert!(alone.status.code() == Some(2) && text.contains("--simulated-walks-effect"), "{text}");
}
