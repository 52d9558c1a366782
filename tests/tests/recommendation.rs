//! What a study recommends, and what it says of the certificate of that gait.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright::store::studies::StudyState;
use gaitwright::store::{StudyId, TrialId, certificates, commit};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::examined::certificate;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};

async fn examined(service: &Service, trial: TrialId, passed: bool) {
    let mut writer = service.store.write().await.unwrap();
    assert!(certificates::keep(&mut writer, trial, &certificate(passed)).await.unwrap());
    commit(writer).await.unwrap();
}

async fn recommendation(service: &Service, study: StudyId) -> Value {
    let answer = service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await;
    assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
    answer.json()
}

#[tokio::test]
async fn nothing_is_recommended_silently_whose_certificate_failed() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| new.trial_budget = 6).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let page = format!("/studies/{study}");

    let fresh = recommendation(&service, study).await;
    assert_eq!((&fresh["certificate"], &fresh["objections"]), (&json!("not_examined"), &json!([])));
    assert!(service.fetch(&page).await.text.contains("Nobody examined this gait yet"));

    let best: TrialId = fresh["trial_id"].as_str().unwrap().parse().unwrap();
    examined(&service, best, false).await;
    let failed = recommendation(&service, study).await;
    assert_eq!(failed["trial_id"], fresh["trial_id"], "the learner's answer is the same");
    assert_eq!(failed["certificate"], "failed");
    assert_eq!((&failed["objections"], &failed["passing"]), (&json!(["the simulated walker falls"]), &Value::Null));
    let shown = service.fetch(&page).await.text;
    assert!(shown.contains("This gait failed its") && shown.contains("the simulated walker falls"), "{shown}");
    assert!(shown.contains("The next best that nobody examined"), "{shown}");
    assert!(service.fetch(&format!("/trials/{best}")).await.text.contains("read why before it is walked with"));
    let table = service.fetch(&format!("/api/v1/studies/{study}/recommendation.csv")).await.text;
    assert!(table.starts_with("bound,value,unit,limits,certificate_of_the_gait\n"), "{table}");
    assert_eq!(table.matches(",failed\n").count(), 8, "{table}");

    let other = service.trials(study).await.into_iter().find(|trial| trial.id != best && trial.state.is_result());
    let other = other.unwrap();
    examined(&service, other.id, true).await;
    let passing = &recommendation(&service, study).await["passing"];
    assert_eq!((&passing["trial_id"], &passing["number"]), (&json!(other.id), &json!(other.number)));
    assert_eq!(passing["bounds"], json!(other.action));
    let shown = service.fetch(&page).await.text;
    assert!(shown.contains(&format!("passed: <a href=\"/trials/{}\">trial {}</a>", other.id, other.number)), "{shown}");
    service.stop().await;
}

#[tokio::test]
async fn a_gait_that_passed_is_said_to_have_passed() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| new.trial_budget = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let best: TrialId = recommendation(&service, study).await["trial_id"].as_str().unwrap().parse().unwrap();
    examined(&service, best, true).await;
    let passed = recommendation(&service, study).await;
    assert_eq!((&passed["certificate"], &passed["passing"]), (&json!("passed"), &Value::Null));
    assert!(service.fetch(&format!("/studies/{study}")).await.text.contains("This gait passed its"));
    service.stop().await;
}
