//! Suggestions, queued solves, and backups over REST.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_learner::{ActionIndex, Feedback};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::Trial;
use gaitwright_store::{StudyId, read_only, studies};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::json;
use std::time::Duration;

/// The feedback that the learner receives.
async fn learner_feedback(service: &Service, study: StudyId) -> Vec<Feedback> {
    let mut reader = service.store.read().await.unwrap();
    let study = studies::get(&mut reader, study).await.unwrap();
    StudySnapshot::read(&mut reader, study).await.unwrap().log().feedback
}

#[tokio::test]
async fn learner_uses_a_suggestion_until_it_is_retracted() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (4, AnswerSource::Both)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await.into_iter().find(|trial| trial.state.as_str() == "converged").unwrap();
    let path = format!("/api/v1/studies/{study}/suggestions");
    let before = learner_feedback(&service, study).await;

    let plan = service.get(study).await.plan;
    let a6 = plan.search_space.values(trial.action_index)[5];
    let other = if a6 == 0.3 { 0.2 } else { 0.3 };
    for (body, field) in [
        (json!({"over": trial.id, "bounds": {"a0": 1.0}}), "bounds"),
        (json!({"over": trial.id, "bounds": {"a6": 0.31}}), "bounds.a6"),
        (json!({"over": trial.id, "bounds": {"a6": a6}}), "bounds"),
        (json!({"over": trial.id, "bounds": {}}), "bounds"),
    ] {
        let refused = service.post(&path, &body).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{body}: {}", refused.text);
        assert_eq!(refused.json()["field"], field, "{body}");
    }
    let by_program = json!({"over": trial.id, "bounds": {"a6": other}, "source": "gait_rmse"});
    let refused = service.post(&path, &by_program).await;
    assert_eq!((refused.status, &refused.json()["field"]), (StatusCode::BAD_REQUEST, &json!("source")));
    assert_eq!(learner_feedback(&service, study).await, before);

    let new = json!({"over": trial.id, "bounds": {"a6": other}, "source": "subject", "author": "S03"});
    let given = service.post(&path, &new).await;
    assert_eq!(given.status, StatusCode::CREATED, "{}", given.text);
    let given = given.json();
    let mut expected = plan.search_space.values(trial.action_index);
    expected[5] = other;
    let names = plan.search_space.dimensions().iter().map(|dimension| dimension.name.clone());
    let bounds: serde_json::Map<_, _> = names.zip(expected.iter().map(|value| json!(value))).collect();
    assert_eq!((&given["bounds"], &given["over"]), (&json!(bounds), &json!(trial.id)));
    let is_suggested = |action: &ActionIndex| plan.search_space.values(*action) == expected;
    let suggested = (0..plan.search_space.len()).map(ActionIndex).find(is_suggested).unwrap();
    let after = learner_feedback(&service, study).await;
    assert_eq!(after[before.len()..], [Feedback::Suggestion { suggested, over: trial.action_index }]);
    assert_eq!(service.fetch(&path).await.items()[0]["id"], given["id"]);
    let answers = service.fetch(&format!("/api/v1/studies/{study}/preferences")).await.text;
    assert!(!answers.contains("suggestion"), "{answers}");

    // A suggestion is not a preference, nor the other way round.
    let id = given["id"].as_str().unwrap();
    assert_eq!(service.fetch(&format!("/api/v1/suggestions/{id}")).await.json(), given);
    assert_eq!(service.fetch(&format!("/api/v1/preferences/{id}")).await.status, StatusCode::NOT_FOUND);
    let preference = service.feedback(study).await[0].id;
    for wrong in [
        format!("preferences/{id}/retract"),
        format!("preferences/{id}/undo"),
        format!("suggestions/{preference}/retract"),
    ] {
        let body = if wrong.ends_with("undo") { json!({}) } else { json!({"reason": "mistyped"}) };
        assert_eq!(service.post(&format!("/api/v1/{wrong}"), &body).await.status, StatusCode::NOT_FOUND, "{wrong}");
    }
    assert_eq!(service.fetch(&format!("/api/v1/suggestions/{preference}")).await.status, StatusCode::NOT_FOUND);
    let retract = format!("/api/v1/suggestions/{id}/retract");
    assert_eq!(service.post(&retract, &json!({"reason": "mistyped"})).await.status, StatusCode::OK);
    assert_eq!(service.post(&retract, &json!({"reason": "again"})).await.status, StatusCode::CONFLICT);
    assert_eq!(learner_feedback(&service, study).await, before);
    assert_eq!(service.fetch(&path).await.items()[0]["retraction"]["reason"], "mistyped");
    service.stop().await;
}

#[tokio::test]
async fn suggestion_and_answer_of_one_person_do_not_both_count() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (12, AnswerSource::Both)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let mut gaits = service.trials(study).await;
    gaits.retain(|trial| trial.state.as_str() == "converged");
    let (one, two, three) = (&gaits[0], &gaits[1], &gaits[2]);
    let suggest = async |over: &Trial, bounds: &Trial, author: &str| {
        let body = json!({"over": over.id, "bounds": bounds.action, "author": author});
        service.post(&format!("/api/v1/studies/{study}/suggestions"), &body).await
    };
    let prefer = async |author: &str| {
        let body = json!({"trial_a": one.id, "trial_b": two.id, "answer": "a", "author": author});
        service.post(&format!("/api/v1/studies/{study}/preferences"), &body).await
    };
    let (created, conflict) = (StatusCode::CREATED, StatusCode::CONFLICT);
    let first = suggest(one, two, "ann").await;
    assert_eq!(first.status, created, "{}", first.text);
    assert_eq!(suggest(one, two, " Ann ").await.status, conflict, "the same again");
    assert_eq!(suggest(two, one, "ann").await.status, conflict, "the contrary");
    assert_eq!(prefer("ann").await.status, conflict, "the contrary as a preference");
    assert_eq!(suggest(one, three, "ann").await.status, created, "another comparison");
    assert_eq!(suggest(one, two, "ben").await.status, created, "another person");
    let retract = format!("/api/v1/suggestions/{}/retract", first.json()["id"].as_str().unwrap());
    assert_eq!(service.post(&retract, &json!({"reason": "mistyped"})).await.status, StatusCode::OK);
    assert_eq!(prefer("ann").await.status, created);
    assert_eq!(suggest(one, two, "ann").await.status, conflict, "against the own preference");

    // Bounds that no trial had.
    let space = service.get(study).await.plan.search_space;
    let untried =
        (0..space.len()).map(ActionIndex).find(|action| gaits.iter().all(|trial| trial.action_index != *action));
    let names = space.dimensions().iter().map(|dimension| dimension.name.clone());
    let bounds: serde_json::Map<_, _> =
        names.zip(space.values(untried.unwrap()).into_iter().map(|v| json!(v))).collect();
    let untried = json!({"over": two.id, "bounds": bounds, "author": "ann"});
    for status in [created, conflict] {
        let given = service.post(&format!("/api/v1/studies/{study}/suggestions"), &untried).await;
        assert_eq!(given.status, status, "{}", given.text);
    }

    let report = json!({"trial_a": three.id, "trial_b": two.id, "answer": "unsafe_a", "author": "S"});
    assert_eq!(service.post(&format!("/api/v1/studies/{study}/assessments"), &report).await.status, created);
    for (over, bounds) in [(three, two), (two, three)] {
        let refused = suggest(over, bounds, "cleo").await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", refused.text);
        assert!(refused.text.contains("reported as unsafe"), "{}", refused.text);
    }
    service.stop().await;
}

#[tokio::test]
async fn queued_jobs_and_workers_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic::slow(Duration::from_millis(50));
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let study = service.study(|new| (new.number_of_trials, new.parallel_trials) = (4, 2)).await;
    let jobs = loop {
        let jobs = service.fetch("/api/v1/jobs").await.items();
        let states: Vec<_> = jobs.as_array().unwrap().iter().map(|job| job["state"].as_str().unwrap()).collect();
        if states.contains(&"running") && states.contains(&"queued") {
            break jobs;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    };
    let running = jobs.as_array().unwrap().iter().find(|job| job["state"] == "running").unwrap();
    assert_eq!((&running["study_id"], &running["solve"]["attempts"]), (&json!(study), &json!(1)));
    assert!(running["solve"]["lease_until"].is_string());
    let workers = service.fetch("/api/v1/workers").await.items();
    assert_eq!(workers.as_array().unwrap().len(), 1);
    assert_eq!((&workers[0]["name"], &workers[0]["running_solves"]), (&running["solve"]["worker"], &json!(1)));
    service.stop().await;
}

#[tokio::test]
async fn requested_backup_is_made_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let copied = service.backed_up().await;
    let file = folder.path().join(copied["file"].as_str().unwrap());
    assert_eq!(std::fs::metadata(&file).unwrap().len(), copied["bytes"].as_u64().unwrap());
    read_only::check(&file).await.unwrap();
    let again = service.backed_up().await;
    assert_ne!(again["file"], copied["file"]);
    service.stop().await;
}

#[tokio::test]
async fn simultaneous_backup_requests_run_one_after_another() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let asked = (0..6).map(|_| service.backed_up());
    let mut names = std::collections::BTreeSet::new();
    for backup in futures_util::future::join_all(asked).await {
        let file = backup["file"].as_str().unwrap().to_owned();
        read_only::check(&folder.path().join(&file)).await.unwrap();
        assert!(names.insert(file), "two copies have one name");
    }
    service.stop().await;
}
