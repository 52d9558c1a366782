//! Infeasibility explanations: computed on request or at the end of a study, stored, and shown as sentences.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, StatusCode};
use gait_optimizer::{DisplayAngleUnit, Mesh, TunedBounds};
use gaitwright_service::workers::GaitSolver;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::studies::{Evaluation, StudyState};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{StudyId, TrialId, events, explanations};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::cli;
use gaitwright_tests::described::audit_trail;
use gaitwright_tests::explained::{Clearance, with_few_gaits, without_gaits};
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use skipped_tests::long_tests_are_skipped;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Longer than any test waits.
const FOR_EVER: Duration = Duration::from_mins(10);

fn address(trial: TrialId) -> String {
    format!("/api/v1/trials/{trial}/explanation")
}

async fn ask(service: &Service, trial: TrialId) -> Answer {
    service.post(&address(trial), &json!({})).await
}

async fn without_gait(service: &Service, study: StudyId) -> Vec<Trial> {
    let mut trials = service.trials(study).await;
    trials.retain(|trial| trial.state == TrialState::NotConverged);
    trials
}

/// Polls until a condition holds.
async fn until(what: &str, mut holds: impl AsyncFnMut() -> bool) {
    for _ in 0..2000 {
        if holds().await {
            return;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    panic!("{what}");
}

/// Waits for the explanation of a trial.
async fn explained(service: &Service, trial: TrialId) -> Value {
    until("the trial is explained", async || service.fetch(&address(trial)).await.status == StatusCode::OK).await;
    service.fetch(&address(trial)).await.json()
}

/// The trials that the service explained, in order.
async fn explained_in_order(service: &Service) -> Vec<String> {
    let mut trail = audit::page(&mut service.store.read().await.unwrap(), "", None, 1000).await.unwrap();
    trail.retain(|row| row.change == "trial.explain" && row.actor == Actor::program().as_str());
    trail.iter().rev().map(|row| row.object.clone()).collect()
}

/// The sentence as on pages, where angles are in degrees.
fn in_degrees(sentence: &str) -> String {
    let words: Vec<&str> = sentence.split(' ').collect();
    let mut shown: Vec<String> = Vec::new();
    for word in words {
        let value = shown.last().and_then(|number| number.parse().ok());
        match (value, word.strip_prefix("rad")) {
            (Some(value), Some(rest)) => {
                shown.pop();
                shown.push(format!("{}{rest}", DisplayAngleUnit::Degree.in_words(value, "rad")));
            }
            _ => shown.push(word.to_owned()),
        }
    }
    shown.join(" ")
}

#[tokio::test]
async fn ended_study_explains_every_trial_without_a_gait_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let explainer = Clearance::slow(Duration::from_millis(100));
    let service = Service::start_explaining(&folder.path().join("a.db"), Analytic::default(), explainer).await;
    let study =
        service.study(|new| (new.number_of_trials, new.search_space) = (8, Some(with_few_gaits().into()))).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = without_gait(&service, study).await;
    assert!(trials.len() > 2);
    let last = trials.last().unwrap();
    assert_eq!(service.fetch(&address(last.id)).await.status, StatusCode::NOT_FOUND);
    let coming = service.fetch(&format!("/api/v1/jobs/explanation-{}", last.id)).await;
    assert_eq!(coming.json()["state"], "queued", "{}", coming.text);
    let page = service.fetch(&format!("/trials/{}", last.id)).await.text;
    assert!(
        page.contains("The service will explain this trial automatically") && page.contains("/explain\""),
        "{page}"
    );

    let found = explained(&service, last.id).await;
    let expected: Vec<String> = trials.iter().map(|trial| format!("trial {}", trial.id)).collect();
    assert_eq!(explained_in_order(&service).await, expected);
    assert_eq!(found["violations"][0]["row"], "SS2_R node 3, swing foot clearance");
    let conflict = &found["conflicts"][0];
    assert_eq!((&conflict["bounds"][0]["bound"], &conflict["starts"]), (&json!("a5"), &json!(5)));
    assert_eq!((&found["gait_found"], &found["together"]), (&json!(false), &json!([])));
    assert_eq!((&found["relaxations"][0]["bound"], &found["relaxations"][0]["to"]), (&json!("a5"), &json!(0.03)));
    assert_eq!(found["program"], Actor::program().as_str());
    assert_eq!(found["problem_sha256"].as_str().unwrap().len(), 64);
    let page = service.fetch(&format!("/trials/{}", last.id)).await.text;
    let kept = explanations::find(&mut service.store.read().await.unwrap(), last.id).await.unwrap().unwrap();
    let sentences = kept.explanation.sentences();
    assert_eq!(found["sentences"], json!(sentences));
    for sentence in &sentences {
        assert!(page.contains(&in_degrees(sentence)), "{sentence}: {page}");
    }
    assert!(!page.contains("/explain\""), "there is nothing to ask for any more");

    let page = service.fetch(&format!("/studies/{study}")).await.text;
    let reason = format!(
        "In all {0} trials with an explanation, relaxing a5 (swing-foot clearance) alone gives a gait",
        trials.len()
    );
    assert!(page.contains(&reason) && page.contains(&format!("/trials/{}#explanation", trials[0].id)), "{page}");
    service.stop().await;
}

#[tokio::test]
async fn repeated_requests_give_one_explanation() {
    let folder = tempfile::tempdir().unwrap();
    let (explainer, solver) = (Clearance::default(), Analytic::slow(Duration::from_millis(20)));
    let counts = explainer.counts.clone();
    let service = Service::start_explaining(&folder.path().join("a.db"), solver, explainer).await;
    let study =
        service.study(|new| (new.number_of_trials, new.search_space) = (9, Some(with_few_gaits().into()))).await;
    until("a trial has no gait", async || !without_gait(&service, study).await.is_empty()).await;
    let trial = without_gait(&service, study).await[0].id;
    assert_eq!(service.fetch(&address(trial)).await.status, StatusCode::NOT_FOUND, "nobody asked");
    let page = service.fetch(&format!("/trials/{trial}")).await.text;
    assert!(page.contains("Find out which bounds conflict"), "{page}");

    let keyed = || {
        let request = Request::post(address(trial)).header("idempotency-key", "one").body(Body::from("{}")).unwrap();
        service.send(request)
    };
    let asked = keyed().await;
    assert_eq!((asked.status, &asked.json()["state"]), (StatusCode::ACCEPTED, &json!("queued")));
    let found = explained(&service, trial).await;
    assert_eq!(service.get(study).await.state, StudyState::Running, "beside its solves");
    let again = ask(&service, trial).await;
    assert_eq!((again.status, &again.json()["state"]), (StatusCode::OK, &json!("done")));
    assert_eq!((&again.json()["result"], &found["trial_id"]), (&json!(address(trial)), &json!(trial)));
    assert_eq!(keyed().await.status, StatusCode::ACCEPTED, "the same request has the same answer");
    assert_eq!(counts.begun.load(Ordering::SeqCst), 1);
    let trail = audit::page(&mut service.store.read().await.unwrap(), "", None, 1000).await.unwrap();
    assert_eq!(trail.iter().filter(|row| row.change == "trial.request_explanation").count(), 1);
    let told = events::after(&mut service.store.read().await.unwrap(), study, 0, 1000).await.unwrap();
    let told: Vec<_> = told.iter().filter(|event| event.kind == "trial_explained").collect();
    assert_eq!((told.len(), &told[0].payload["relaxed_bound"]), (1, &json!("a5")));
    let details = audit_trail(&service).await;
    assert!(["relaxed_bound"].iter().all(|name| details.contains(*name)), "{details:?}");
    service.stop().await;
}

#[tokio::test]
async fn study_without_failed_solves_is_not_explained() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start_explaining(&database, Analytic::default(), Clearance::default()).await;
    let study = service.study(|new| new.number_of_trials = 1).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let script = service.study(|new| (new.evaluation, new.number_of_trials) = (Evaluation::Script, 1)).await;
    let asked = service.post(&format!("/api/v1/studies/{script}/ask"), &json!({})).await.json();
    let told: TrialId = asked["id"].as_str().unwrap().parse().unwrap();
    let outcome = json!({"label": "not_converged", "reason": "the foot scuffed"});
    assert_eq!(service.post(&format!("/api/v1/trials/{told}/tell"), &outcome).await.status, StatusCode::OK);
    service.wait_for(script, &[StudyState::Finished]).await;
    for (trial, reason) in [
        (service.trials(study).await[0].id, "Only a trial that did not converge can be explained"),
        (told, "Trial 1 was evaluated by a script"),
    ] {
        let refused = ask(&service, trial).await;
        assert_eq!(refused.status, StatusCode::CONFLICT, "{}", refused.text);
        assert!(refused.text.contains(reason), "{}", refused.text);
        assert_eq!(service.fetch(&address(trial)).await.status, StatusCode::NOT_FOUND);
    }
    let page = service.fetch(&format!("/trials/{told}")).await.text;
    assert!(page.contains("the foot scuffed") && !page.contains("id=\"explanation\""), "{page}");
    service.stop().await;
}

#[tokio::test]
async fn requested_explanation_is_made_after_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let explainer = Clearance::slow(FOR_EVER);
    let counts = explainer.counts.clone();
    let solver = Analytic::slow(Duration::from_millis(5));
    let service = Service::start_explaining(&database, solver, explainer).await;
    let study = service.study(|new| (new.number_of_trials, new.search_space) = (9, Some(without_gaits().into()))).await;
    service.wait_for_trials(study, 2).await;
    service.post(&format!("/api/v1/studies/{study}/pause"), &json!({})).await;
    let trials = without_gait(&service, study).await;
    for trial in [&trials[1], &trials[0]] {
        assert_eq!(ask(&service, trial.id).await.status, StatusCode::ACCEPTED);
    }
    until("one is begun", async || counts.begun.load(Ordering::SeqCst) == 1).await;
    let page = service.fetch(&format!("/trials/{}", trials[1].id)).await.text;
    assert!(
        page.contains("is solving this trial again with relaxed bounds") && page.contains("explanation.mjs"),
        "{page}"
    );
    service.stop().await;
    until("it is cancelled", async || counts.cancelled.load(Ordering::SeqCst) == 1).await;

    let service = Service::start_explaining(&database, Analytic::default(), Clearance::default()).await;
    for trial in &trials[..2] {
        explained(&service, trial.id).await;
    }
    let expected = [&trials[1], &trials[0]].map(|trial| format!("trial {}", trial.id));
    assert_eq!(explained_in_order(&service).await, expected, "first what was asked for first, and nothing else");
    service.stop().await;
}

#[tokio::test]
async fn cancelled_explanation_keeps_the_conflict_until_a_complete_one_is_made() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let explainer = Clearance { finds_conflict_first: true, ..Clearance::slow(FOR_EVER) };
    let counts = explainer.counts.clone();
    let service = Service::start_explaining(&database, Analytic::slow(Duration::from_millis(5)), explainer).await;
    let study = service.study(|new| (new.number_of_trials, new.search_space) = (9, Some(without_gaits().into()))).await;
    service.wait_for_trials(study, 1).await;
    service.post(&format!("/api/v1/studies/{study}/pause"), &json!({})).await;
    let trial = without_gait(&service, study).await[0].id;
    assert_eq!(ask(&service, trial).await.status, StatusCode::ACCEPTED);
    until("it is begun", async || counts.begun.load(Ordering::SeqCst) == 1).await;
    let job = format!("/api/v1/jobs/explanation-{trial}");
    assert_eq!(service.post(&format!("{job}/cancel"), &json!({})).await.json()["state"], "cancelled");
    let part = explained(&service, trial).await;
    assert_eq!((&part["stopped_early"], &part["relaxations"]), (&json!(true), &json!([])));
    assert_eq!(part["conflicts"][0]["bounds"][0]["bound"], "a5");
    assert_eq!(service.fetch(&job).await.json()["state"], "cancelled");
    let page = service.fetch(&format!("/trials/{trial}")).await.text;
    assert!(page.contains("was stopped early") && page.contains("Repeat the search in full"), "{page}");
    service.stop().await;

    let service = Service::start_explaining(&database, Analytic::default(), Clearance::default()).await;
    assert_eq!(explained(&service, trial).await["stopped_early"], true, "it is on record");
    assert_eq!(ask(&service, trial).await.status, StatusCode::ACCEPTED);
    until("it is complete", async || explained(&service, trial).await["stopped_early"] == false).await;
    let page = service.fetch(&format!("/trials/{trial}")).await.text;
    assert!(!page.contains("was stopped early") && !page.contains("Repeat the search"), "{page}");
    assert_eq!(ask(&service, trial).await.status, StatusCode::OK, "nothing is left to do");
    service.stop().await;
}

#[tokio::test]
async fn withdrawal_stops_explanations() {
    let folder = tempfile::tempdir().unwrap();
    let explainer = Clearance::slow(FOR_EVER);
    let counts = explainer.counts.clone();
    let service = Service::start_explaining(&folder.path().join("a.db"), Analytic::default(), explainer).await;
    let study = service.study(|new| (new.number_of_trials, new.search_space) = (3, Some(without_gaits().into()))).await;
    until("one is begun", async || counts.begun.load(Ordering::SeqCst) == 1).await;
    let withdraw = format!("/api/v1/subjects/{}/withdraw", service.subject().await);
    assert_eq!(service.post(&withdraw, &json!({"reason": "moved away"})).await.status, StatusCode::OK);
    until("it is cancelled", async || counts.cancelled.load(Ordering::SeqCst) == 1).await;
    for trial in service.trials(study).await {
        assert_eq!(ask(&service, trial.id).await.status, StatusCode::CONFLICT);
        let kept = explanations::find(&mut service.store.read().await.unwrap(), trial.id).await.unwrap();
        assert_eq!(kept, None);
    }
    assert_eq!(counts.begun.load(Ordering::SeqCst), 1);
    service.stop().await;
}

#[tokio::test]
async fn refused_explanation_states_its_reason_and_is_not_retried() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let explainer = Clearance { panics: true, ..Clearance::default() };
    let counts = explainer.counts.clone();
    let service = Service::start_explaining(&database, Analytic::default(), explainer).await;
    let study = service.study(|new| (new.number_of_trials, new.search_space) = (2, Some(without_gaits().into()))).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await[1].id;
    until("it is refused", async || service.fetch(&address(trial)).await.status == StatusCode::CONFLICT).await;
    let refused = ask(&service, trial).await;
    assert_eq!(refused.status, StatusCode::CONFLICT);
    assert!(
        refused.text.contains("Trial 2 cannot be explained") && refused.text.contains("panicked"),
        "{}",
        refused.text
    );
    let page = service.fetch(&format!("/trials/{trial}")).await.text;
    assert!(page.contains("This trial cannot be explained") && page.contains("panicked"), "{page}");
    assert_eq!(counts.begun.load(Ordering::SeqCst), 2, "each once");
    let told = events::after(&mut service.store.read().await.unwrap(), study, 0, 1000).await.unwrap();
    assert_eq!(told.iter().filter(|event| event.kind == "trial_not_explained").count(), 2);
    service.stop().await;

    let service = Service::start_explaining(&database, Analytic::default(), Clearance::default()).await;
    explained(&service, trial).await;
    service.stop().await;
}

/// Presses the button that tries the first relaxation of a trial in its study.
async fn try_relaxation(service: &Service, trial: TrialId, place: usize) -> Answer {
    let (path, form) = (format!("/trials/{trial}/relaxed-trial"), format!("relaxation={place}"));
    service.post_text(&path, "application/x-www-form-urlencoded", &form).await
}

#[tokio::test]
async fn relaxation_within_the_search_space_is_tried_in_the_same_study() {
    let folder = tempfile::tempdir().unwrap();
    let service =
        Service::start_explaining(&folder.path().join("a.db"), Analytic::default(), Clearance::default()).await;
    let study =
        service.study(|new| (new.number_of_trials, new.search_space) = (2, Some(with_few_gaits().into()))).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = without_gait(&service, study).await.remove(0);
    explained(&service, trial.id).await;
    let page = service.fetch(&format!("/trials/{}", trial.id)).await.text;
    assert!(page.contains("Try a5 = 0.02 m in this study"), "{page}");
    assert!(page.contains("This adds one trial to the study."), "{page}");
    assert_eq!(try_relaxation(&service, trial.id, 1).await.status, StatusCode::UNPROCESSABLE_ENTITY);

    // Two people press the button at the same time.
    let (one, other) = tokio::join!(try_relaxation(&service, trial.id, 0), try_relaxation(&service, trial.id, 0));
    let (made, refused) = if one.status == StatusCode::SEE_OTHER { (one, other) } else { (other, one) };
    assert_eq!((made.status, refused.status), (StatusCode::SEE_OTHER, StatusCode::CONFLICT), "{}", refused.text);
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    assert_eq!((trials.len(), service.get(study).await.plan.number_of_trials), (3, 3));
    let relaxed = &trials[2];
    assert_eq!(made.headers["location"].to_str().unwrap(), format!("/trials/{}", relaxed.id));
    let expected = TunedBounds { a5: 0.02, ..trial.action };
    assert_eq!((relaxed.action, relaxed.state), (expected, TrialState::Converged));
    assert_eq!(relaxed.reason, format!("requested by a person: trial {} with a5 relaxed", trial.number));
    let trail = audit::page(&mut service.store.read().await.unwrap(), "", None, 1000).await.unwrap();
    let rows: Vec<_> = trail.iter().filter(|row| row.change == "trial.relax").collect();
    assert_eq!(rows.iter().map(|row| row.object.clone()).collect::<Vec<_>>(), [format!("trial {}", relaxed.id)]);

    let page = service.fetch(&format!("/trials/{}", trial.id)).await.text;
    assert!(page.contains(">trial 3</a> already has these bounds") && !page.contains("/relaxed-trial"), "{page}");
    let details = audit_trail(&service).await;
    assert!(["number_of_trials", "without_gait"].iter().all(|name| details.contains(*name)), "{details:?}");
    service.stop().await;
}

#[tokio::test]
async fn relaxation_outside_the_search_space_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let service =
        Service::start_explaining(&folder.path().join("a.db"), Analytic::default(), Clearance::default()).await;
    let study = service.study(|new| (new.number_of_trials, new.search_space) = (1, Some(without_gaits().into()))).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await.remove(0).id;
    explained(&service, trial).await;
    let page = service.fetch(&format!("/trials/{trial}")).await.text;
    let reason = "The loosest value of a5 in this study is 0.032 m, which is not loose enough.";
    assert!(page.contains(reason) && page.contains("New study with a5 = 0.03 m"), "{page}");
    assert!(!page.contains("/relaxed-trial"), "{page}");
    let refused = try_relaxation(&service, trial, 0).await;
    assert!(refused.status == StatusCode::CONFLICT && refused.text.contains(reason), "{}", refused.text);
    assert_eq!(service.trials(study).await.len(), 1);
    service.stop().await;
}

/// The service and the command line give the same explanation, in the same words.
#[tokio::test]
async fn service_and_command_line_give_the_same_explanation() {
    if long_tests_are_skipped("") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let service =
        Service::start_explaining(&folder.path().join("a.db"), GaitSolver, gaitwright_service::workers::GaitExplainer)
            .await;
    let study = service
        .study(|new| {
            (new.muscles, new.number_of_trials) = (false, 1);
            new.gait_settings.mesh = Mesh { ds2: 2, ds3: 2, ss2: 3, ss1: 5 };
            (new.solve_options.retry, new.solve_options.initial_guesses) = (false, 1);
            new.base_bounds = TunedBounds { a2: 10.0, ..TunedBounds::default() };
            let first = json!({"name": "a1", "values": [15.0, 20.0], "lengthscale": 5.0});
            new.search_space = Some(serde_json::from_value(json!({"dimensions": [first]})).unwrap());
        })
        .await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = without_gait(&service, study).await.remove(0);
    let problem = service.fetch(&format!("/api/v1/trials/{}/problem.json", trial.id)).await.text;
    std::fs::write(folder.path().join("problem.json"), problem).unwrap();
    let solve = ["solve", "--problem", "problem.json", "--explain"];
    let output = cli::run(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), &solve);
    let there = String::from_utf8(output.stdout).unwrap();
    let progress = String::from_utf8(output.stderr).unwrap();
    assert!(progress.contains("searching for conflicting bounds"), "{progress}");

    while service.fetch(&address(trial.id)).await.status != StatusCode::OK {
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    let here = explanations::find(&mut service.store.read().await.unwrap(), trial.id).await.unwrap().unwrap();
    for sentence in here.explanation.sentences() {
        assert!(there.contains(&sentence), "{sentence}: {there}");
    }
    assert!(here.explanation.relief().is_some(), "{there}");
    service.stop().await;
}
