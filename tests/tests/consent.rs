//! A subject who withdraws: studies stop, nothing new is written or given out, the record is kept.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright::store::audit;
use gaitwright::store::studies::{Evaluation, FeedbackMode, StudyState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::json;
use std::time::Duration;

#[tokio::test]
async fn after_withdrawal_nothing_new_is_written_and_nothing_is_given_out() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::slow(Duration::from_millis(20)), 1).await;
    let person = service.subject().await;
    let finished = service.study(|new| new.trial_budget = 3).await;
    service.wait_for(finished, &[StudyState::Finished]).await;
    let draft = service.study(|new| new.start = false).await;
    let human = service.study(|new| (new.trial_budget, new.feedback_mode) = (6, FeedbackMode::Human)).await;
    service.wait_for(human, &[StudyState::Waiting]).await;
    let script = service.study(|new| (new.trial_budget, new.evaluation) = (3, Evaluation::Script)).await;
    let asked = service.post(&format!("/api/v1/studies/{script}/ask"), &json!({})).await.json();
    let running = service.study(|new| new.trial_budget = 50).await;
    while !service.trials(running).await.iter().any(|trial| trial.state.is_open()) {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }

    let of_subject = format!("/api/v1/subjects/{person}");
    let given = service.post(&format!("{of_subject}/consents"), &json!({"form": "version 3"})).await;
    assert_eq!(given.status, StatusCode::CREATED, "{}", given.text);
    let empty = service.post(&format!("{of_subject}/withdraw"), &json!({"reason": " "})).await;
    assert_eq!(empty.status, StatusCode::UNPROCESSABLE_ENTITY);
    let before = audit::page(&mut service.store.read().await.unwrap(), None, 1000).await.unwrap().len();
    let withdraw = json!({"reason": "moved away"});
    let withdrawn = service.post(&format!("{of_subject}/withdraw"), &withdraw).await;
    assert_eq!(withdrawn.status, StatusCode::OK, "{}", withdrawn.text);
    let trail = audit::page(&mut service.store.read().await.unwrap(), None, 1000).await.unwrap();
    assert_eq!((trail.len(), trail[0].action.as_str()), (before + 1, "subject.withdraw"));
    assert_eq!(trail[0].detail["stopped"].as_array().unwrap().len(), 4);
    assert_eq!(service.post(&format!("{of_subject}/withdraw"), &withdraw).await.status, StatusCode::CONFLICT);
    for study in [draft, human, script, running] {
        assert_eq!(service.get(study).await.state, StudyState::Stopped);
        assert!(service.trials(study).await.iter().all(|trial| !trial.state.is_open()));
    }

    // Whichever way something new comes in.
    let trials = service.trials(finished).await;
    let (heard, tried) = (service.feedback(finished).await, service.trials(running).await.len());
    let answer = json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "a"});
    let ended = |trial: &gaitwright::store::trials::Trial| trial.state.as_str() == "cancelled";
    let cancelled = service.trials(running).await.into_iter().find(ended).unwrap().id;
    for (path, body) in [
        ("/api/v1/studies".to_owned(), json!({"subject_id": person})),
        (format!("/api/v1/studies/{finished}/fork"), json!({})),
        (format!("/api/v1/studies/{running}/extend"), json!({"trial_budget": 60})),
        (format!("/api/v1/studies/{finished}/preferences"), answer),
        (format!("/api/v1/studies/{script}/ask"), json!({})),
        (format!("/api/v1/trials/{cancelled}/retry"), json!({})),
        (
            format!("/api/v1/trials/{}/tell", asked["id"].as_str().unwrap()),
            json!({"outcome": "converged", "gait_rmse_rad": 0.2}),
        ),
    ] {
        let refused = service.post(&path, &body).await;
        assert_eq!(refused.status, StatusCode::CONFLICT, "{path}: {}", refused.text);
    }
    let blind = service.post(&format!("/api/v1/studies/{human}/blind/next"), &json!({})).await;
    assert!(blind.json()["pair"].is_null(), "{}", blind.text);
    let form = format!("a={}&b={}&answer=b&source=subject&author=K&key={}", trials[0].id, trials[1].id, trials[0].id);
    let kind = "application/x-www-form-urlencoded";
    let refused = service.post_text(&format!("/studies/{finished}/compare"), kind, &form).await;
    assert_eq!(refused.status, StatusCode::CONFLICT, "{}", refused.text);
    tokio::time::sleep(Duration::from_millis(300)).await;
    assert_eq!(service.feedback(finished).await, heard);
    assert_eq!(service.trials(running).await.len(), tried);

    // Nothing is given out; the record is kept.
    for path in ["trials.csv", "history.csv"] {
        let refused = service.fetch(&format!("/api/v1/studies/{finished}/{path}")).await;
        assert_eq!(refused.status, StatusCode::CONFLICT, "{path}: {}", refused.text);
    }
    let table = service.fetch_as(&format!("/api/v1/studies/{finished}/preferences"), "text/csv").await;
    assert_eq!(table.status, StatusCode::CONFLICT);
    let gait = service.fetch(&format!("/api/v1/trials/{}/gait.csv", trials[0].id)).await;
    assert_eq!(gait.status, StatusCode::CONFLICT);
    let compared = service.fetch(&format!("/api/v1/compare?ids={finished},{running}")).await;
    assert_eq!(compared.status, StatusCode::CONFLICT);
    assert_eq!(service.fetch(&format!("/api/v1/studies/{finished}/trials")).await.status, StatusCode::OK);
    let said = service.fetch(&format!("{of_subject}/consents")).await.json();
    let kinds: Vec<_> = said.as_array().unwrap().iter().map(|row| row["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["given", "withdrawn"]);

    // Who comes back, signs anew.
    service.post(&format!("{of_subject}/consents"), &json!({"form": "version 4"})).await;
    let again = service.post("/api/v1/studies", &json!({"subject_id": person, "start": false})).await;
    assert_eq!(again.status, StatusCode::CREATED, "{}", again.text);
    service.stop().await;
}
