//! Jobs: the response to long-running requests, following a job to its end, and cancellation.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_optimizer::Gait;
use gaitwright_service::access::{Caller, Right};
use gaitwright_service::job::{JobId, JobState};
use gaitwright_service::studies::job_cancellation;
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{StudyId, TokenId, TrialId, commit};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers::FORM;
use gaitwright_tests::certified::Verdicts;
use gaitwright_tests::cli;
use gaitwright_tests::explained::{Clearance, with_few_gaits};
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use std::sync::atomic::Ordering;
use std::time::Duration;
use tempfile::TempDir;

/// A service with a running study, slow certificates, and explanations that never finish.
async fn service() -> (TempDir, Service, StudyId, Clearance) {
    let folder = tempfile::tempdir().unwrap();
    let explainer = Clearance::slow(Duration::from_mins(10));
    let watched = Clearance { counts: explainer.counts.clone(), ..Clearance::default() };
    let certifier = Verdicts { pause: Duration::from_millis(300), passes: |_: &Gait| true };
    let solver = Analytic::slow(Duration::from_millis(10));
    let service = Service::start_looking_back(&folder.path().join("a.db"), solver, certifier, explainer).await;
    let study =
        service.study(|new| (new.number_of_trials, new.search_space) = (60, Some(with_few_gaits().into()))).await;
    (folder, service, study, watched)
}

async fn first(service: &Service, study: StudyId, state: TrialState) -> TrialId {
    for _ in 0..2000 {
        let trials: Vec<Trial> = service.trials(study).await;
        if let Some(trial) = trials.iter().find(|trial| trial.state == state) {
            return trial.id;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    panic!("no trial is {state:?}");
}

fn address(answer: &Answer) -> String {
    assert_eq!(answer.status, StatusCode::ACCEPTED, "{}", answer.text);
    let address = answer.headers["location"].to_str().unwrap().to_owned();
    assert_eq!(address, format!("/api/v1/jobs/{}", answer.json()["id"].as_str().unwrap()));
    address
}

async fn wait_for(service: &Service, job: &str, state: &str) -> Value {
    for _ in 0..2000 {
        let found = service.fetch(job).await.json();
        if found["state"] == state {
            return found;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    panic!("{job} is not {state}: {}", service.fetch(job).await.text);
}

async fn listed(service: &Service, kind: &str) -> Vec<Value> {
    service.fetch(&format!("/api/v1/jobs?kind={kind}")).await.items().as_array().unwrap().clone()
}

#[tokio::test]
async fn certificate_job_links_to_its_result() {
    let (_folder, service, study, _) = service().await;
    let trial = first(&service, study, TrialState::Converged).await;
    let certificate = format!("/api/v1/trials/{trial}/certificate");
    assert_eq!(service.fetch(&format!("/api/v1/jobs/certificate-{trial}")).await.status, StatusCode::NOT_FOUND);
    let asked = service.post(&certificate, &json!({})).await;
    let job = address(&asked);
    assert_eq!((&asked.json()["kind"], &asked.json()["result"]), (&json!("certificate"), &Value::Null));
    assert_eq!(listed(&service, "certificate").await[0]["trial_id"], json!(trial));
    let done = wait_for(&service, &job, "done").await;
    assert_eq!(done["result"], certificate);
    assert_eq!(service.fetch(&certificate).await.json()["passed"], true);
    let again = service.post(&certificate, &json!({})).await;
    assert_eq!((again.status, again.json()), (StatusCode::OK, done), "the job alone, as reading needs another right");
    assert!(listed(&service, "certificate").await.is_empty());
    assert_eq!(service.post(&format!("{job}/cancel"), &json!({})).await.status, StatusCode::CONFLICT, "it has ended");
    service.stop().await;
}

#[tokio::test]
async fn cancelled_certificate_is_not_computed() {
    let (_folder, service, study, _) = service().await;
    let trial = first(&service, study, TrialState::Converged).await;
    let certificate = format!("/api/v1/trials/{trial}/certificate");
    let job = address(&service.post(&certificate, &json!({})).await);
    let cancelled = service.post(&format!("{job}/cancel"), &json!({})).await;
    assert_eq!((cancelled.status, &cancelled.json()["state"]), (StatusCode::OK, &json!("cancelled")));
    tokio::time::sleep(Duration::from_millis(600)).await;
    assert_eq!(service.get(study).await.state, StudyState::Running, "a study that ends certifies its best gaits");
    assert_eq!(service.fetch(&certificate).await.status, StatusCode::NOT_FOUND);
    service.stop().await;
}

#[tokio::test]
async fn requested_certificate_is_computed_after_a_restart_unless_cancelled() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let certifier = |pause| Verdicts { pause, passes: |_: &Gait| true };
    let solver = || Analytic::slow(Duration::from_millis(10));
    let slow = certifier(Duration::from_mins(10));
    let service = Service::start_looking_back(&database, solver(), slow, Clearance::default()).await;
    let study =
        service.study(|new| (new.number_of_trials, new.search_space) = (60, Some(with_few_gaits().into()))).await;
    let mut converged = Vec::new();
    while converged.len() < 2 {
        tokio::time::sleep(Duration::from_millis(5)).await;
        converged = service.trials(study).await;
        converged.retain(|trial| trial.state == TrialState::Converged);
    }
    // If the study continued, it would end and certify its best gaits by itself.
    service.post(&format!("/api/v1/studies/{study}/pause"), &json!({})).await;
    let (kept, cancelled) = (converged[0].id, converged[1].id);
    // The button on the page does not wait for the certificate.
    let button = format!("/trials/{kept}/certify");
    let pressed = service.post_text(&button, "application/x-www-form-urlencoded", "").await;
    assert_eq!(pressed.status, StatusCode::SEE_OTHER, "{}", pressed.text);
    let page = service.fetch(&format!("/trials/{kept}")).await.text;
    assert!(page.contains(&format!("data-job=\"certificate-{kept}\"")) && !page.contains(&button), "{page}");
    let mut jobs = vec![format!("/api/v1/jobs/certificate-{kept}")];
    jobs.push(address(&service.post(&format!("/api/v1/trials/{cancelled}/certificate"), &json!({})).await));
    assert_eq!(service.post(&format!("{}/cancel", jobs[1]), &json!({})).await.status, StatusCode::OK);
    service.stop().await;

    let quick = certifier(Duration::ZERO);
    let service = Service::start_looking_back(&database, solver(), quick, Clearance::default()).await;
    wait_for(&service, &jobs[0], "done").await;
    assert_eq!(service.fetch(&format!("/api/v1/trials/{kept}/certificate")).await.json()["passed"], true);
    assert!(listed(&service, "certificate").await.is_empty());
    assert_eq!(service.fetch(&jobs[1]).await.json()["state"], "cancelled", "until it is requested again");
    assert_eq!(service.fetch(&format!("/api/v1/trials/{cancelled}/certificate")).await.status, StatusCode::NOT_FOUND);
    address(&service.post(&format!("/api/v1/trials/{cancelled}/certificate"), &json!({})).await);
    wait_for(&service, &jobs[1], "done").await;
    service.stop().await;
}

#[tokio::test]
async fn explanation_job_stops_and_starts_again() {
    let (_folder, service, study, watched) = service().await;
    let trial = first(&service, study, TrialState::NotConverged).await;
    let explanation = format!("/api/v1/trials/{trial}/explanation");
    let job = address(&service.post(&explanation, &json!({})).await);
    wait_for(&service, &job, "running").await;
    assert_eq!(listed(&service, "explanation").await[0]["study_id"], json!(study));
    assert_eq!(service.fetch(&explanation).await.status, StatusCode::NOT_FOUND);
    assert_eq!(service.post(&format!("{job}/cancel"), &json!({})).await.json()["state"], "cancelled");
    wait_for(&service, &job, "cancelled").await;
    while watched.counts.cancelled.load(Ordering::SeqCst) == 0 {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    assert!(listed(&service, "explanation").await.is_empty());
    address(&service.post(&explanation, &json!({})).await);
    wait_for(&service, &job, "running").await;
    assert_eq!(service.post(&format!("{job}/cancel"), &json!({})).await.status, StatusCode::OK);
    let page = service.post_text(&format!("/trials/{trial}/explain"), FORM, "").await;
    assert_eq!(page.status, StatusCode::SEE_OTHER, "{}", page.text);
    wait_for(&service, &job, "running").await;
    service.stop().await;
}

#[tokio::test]
async fn cancelled_explanation_stays_cancelled_after_a_restart() {
    let (folder, service, study, _) = service().await;
    let trial = first(&service, study, TrialState::NotConverged).await;
    service.post(&format!("/api/v1/studies/{study}/pause"), &json!({})).await;
    let explanation = format!("/api/v1/trials/{trial}/explanation");
    let job = address(&service.post(&explanation, &json!({})).await);
    wait_for(&service, &job, "running").await;
    assert_eq!(service.post(&format!("{job}/cancel"), &json!({})).await.status, StatusCode::OK);
    service.stop().await;

    let solver = Analytic::slow(Duration::from_millis(10));
    let service = Service::start_explaining(&folder.path().join("a.db"), solver, Clearance::default()).await;
    wait_for(&service, &job, "cancelled").await;
    assert!(listed(&service, "explanation").await.is_empty());
    assert_eq!(service.fetch(&explanation).await.status, StatusCode::NOT_FOUND);
    address(&service.post(&explanation, &json!({})).await);
    wait_for(&service, &job, "done").await;
    service.stop().await;
}

#[tokio::test]
async fn backup_job_links_to_its_result() {
    let (folder, service, ..) = service().await;
    let job = address(&service.post("/api/v1/backups", &json!({})).await);
    let done = wait_for(&service, &job, "done").await;
    assert_eq!((&done["kind"], &done["trial_id"], &done["study_id"]), (&json!("backup"), &Value::Null, &Value::Null));
    let backup = service.fetch(done["result"].as_str().unwrap()).await.json();
    assert!(folder.path().join(backup["file"].as_str().unwrap()).exists(), "{backup}");
    // The record knows the result before the task of the backup ends and leaves the list.
    let left_the_list = async {
        while !listed(&service, "backup").await.is_empty() {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    tokio::time::timeout(Duration::from_secs(10), left_the_list).await.unwrap();
    assert_eq!(service.post(&format!("{job}/cancel"), &json!({})).await.status, StatusCode::CONFLICT, "it has ended");
    service.stop().await;
}

#[tokio::test]
async fn cancelled_or_interrupted_backup_leaves_no_file() {
    let (folder, service, ..) = service().await;
    let state = service.state();
    let (store, runners) = (&service.store, state.runners());
    let admin = Caller::token(TokenId::fresh(), "admin", &[Right::Run, Right::Administer]);
    let mut writer = store.write().await.unwrap();
    let requested = state.backups.request(store, &mut writer, &admin.actor).await.unwrap();
    let left = state.backups.request(store, &mut writer, &admin.actor).await.unwrap();
    commit(writer).await.unwrap();
    let (id, interrupted) = (requested.id, left.id);
    // A backup needs a reader, and all are taken.
    let mut readers = Vec::new();
    for _ in 0..4 {
        readers.push(store.read().await.unwrap());
    }
    let work = requested.begin(store.clone(), admin.actor.clone());
    let mut writer = store.write().await.unwrap();
    let program = Caller::token(TokenId::fresh(), "script", &[Right::Run]);
    let refused = job_cancellation::cancel(&mut writer, &program, runners, JobId::Backup(id)).await.unwrap_err();
    assert!(refused.to_string().contains("administrator"), "{refused}");
    let cancelled = job_cancellation::cancel(&mut writer, &admin, runners, JobId::Backup(id)).await.unwrap();
    assert_eq!(cancelled.state, JobState::Cancelled);
    commit(writer).await.unwrap();
    job_cancellation::stop(runners, JobId::Backup(id)).await;
    work.await.unwrap();
    drop((readers, left));
    let found = async |id| service.fetch(&format!("/api/v1/jobs/backup-{id}")).await.json();
    assert_eq!(found(id).await["state"], "cancelled");
    let interrupted = found(interrupted).await;
    assert_eq!(interrupted["state"], "failed");
    assert!(
        interrupted["reason"].as_str().unwrap().contains("stopped before the backup was complete"),
        "{interrupted}"
    );
    let files = cli::files(folder.path());
    assert!(!files.iter().any(|name| name.contains("backup-")), "{files:?}");
    service.stop().await;
}

#[tokio::test]
async fn solve_job_ends_in_the_state_of_its_trial() {
    let (_folder, service, study, _) = service().await;
    let trial = first(&service, study, TrialState::Running).await;
    let job = format!("/api/v1/jobs/solve-{trial}");
    let found = service.fetch(&job).await.json();
    assert_eq!((&found["study_id"], &found["kind"]), (&json!(study), &json!("solve")));
    assert!(listed(&service, "solve").await.iter().any(|job| job["study_id"] == json!(study)));
    // The job may have ended meanwhile; a newer one takes its place.
    loop {
        let trial = first(&service, study, TrialState::Running).await;
        let job = format!("/api/v1/jobs/solve-{trial}");
        if service.post(&format!("{job}/cancel"), &json!({})).await.status == StatusCode::OK {
            assert_eq!(wait_for(&service, &job, "cancelled").await["solve"], Value::Null);
            assert_eq!(service.fetch(&format!("/api/v1/trials/{trial}")).await.json()["state"], "cancelled");
            break;
        }
    }
    assert_eq!(service.fetch("/api/v1/jobs/solve-nothing").await.status, StatusCode::NOT_FOUND);
    service.stop().await;
}
