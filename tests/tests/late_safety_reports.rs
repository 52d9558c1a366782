//! A safety report is accepted in every state of a comparison, and closes the gait. A comparison has one answer, but no
//! answer, close or unblinding makes a report too late.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{FeedbackId, StudyId, TrialId, lab_sessions};
use gaitwright_tests::callers::FORM;
use gaitwright_tests::service::{Answer, Service};
use gaitwright_tests::well_formed::WellFormed;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use tempfile::TempDir;

async fn service() -> (TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), WellFormed::default(), 1).await;
    (folder, service)
}

async fn converged(service: &Service, study: StudyId) -> Vec<Trial> {
    let mut trials = service.trials(study).await;
    trials.retain(|trial| trial.state == TrialState::Converged);
    trials
}

/// The gaits with a report in force.
async fn closed(service: &Service, study: StudyId) -> BTreeSet<String> {
    let reports = service.fetch(&format!("/api/v1/studies/{study}/safety-reports")).await.items();
    let open = reports.as_array().unwrap().iter().filter(|report| report["in_force"] == json!(true));
    open.map(|report| report["trial_id"].as_str().unwrap().to_owned()).collect()
}

fn names(trials: &[TrialId]) -> BTreeSet<String> {
    trials.iter().map(ToString::to_string).collect()
}

async fn clear(service: &Service, gait: &str) {
    let review = json!({"decision": "cleared", "reason": "seen again"});
    let cleared = service.post(&format!("/api/v1/trials/{gait}/safety-reviews"), &review).await;
    assert_eq!(cleared.status, StatusCode::CREATED, "{}", cleared.text);
}

/// A study that waits for the answer to a pair, and the address of the pair.
async fn pair(service: &Service) -> (StudyId, String) {
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (6, AnswerSource::People)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let pair = service.post(&format!("/api/v1/studies/{study}/blind-pairs/next"), &json!({})).await.json();
    (study, pair["pair"]["code"].as_str().unwrap().to_owned())
}

async fn rate(service: &Service, code: &str, answer: &str) -> Answer {
    service.post(&format!("/api/v1/blind-pairs/{code}/answer"), &json!({"answer": answer})).await
}

#[tokio::test]
async fn rater_reports_a_gait_of_an_answered_pair() {
    let (_folder, service) = service().await;
    let (study, code) = pair(&service).await;
    assert_eq!(rate(&service, &code, "first").await.status, StatusCode::OK);
    assert_eq!(rate(&service, &code, "second").await.status, StatusCode::CONFLICT);
    let page = service.fetch(&format!("/rate/pair/{code}")).await.text;
    assert!(page.contains("Report a gait in this pair as unsafe"), "{page}");
    let form = "answer=unsafe_second&note=knee+buckled";
    let sent = service.post_text(&format!("/rate/pair/{code}"), FORM, form).await;
    assert_eq!(sent.status, StatusCode::SEE_OTHER, "{}", sent.text);
    let told = service.fetch(&format!("/rate?saved={code}&reported=true")).await.text;
    assert!(told.contains("Your safety report has been recorded"), "{told}");
    assert_eq!(closed(&service, study).await.len(), 1);
    // The other one, too.
    assert_eq!(rate(&service, &code, "unsafe_both").await.status, StatusCode::OK);
    assert_eq!(closed(&service, study).await.len(), 2);
    service.stop().await;
}

#[tokio::test]
async fn rater_reports_a_gait_of_a_retracted_pair() {
    let (_folder, service) = service().await;
    let (study, code) = pair(&service).await;
    assert_eq!(rate(&service, &code, "first").await.status, StatusCode::OK);
    let retracted = service.post_text(&format!("/rate/pair/{code}/retract"), FORM, "").await;
    assert_eq!(retracted.status, StatusCode::SEE_OTHER, "{}", retracted.text);
    assert_eq!(rate(&service, &code, "first").await.status, StatusCode::CONFLICT);
    assert_eq!(rate(&service, &code, "unsafe_first").await.status, StatusCode::OK);
    assert_eq!(closed(&service, study).await.len(), 1);
    service.stop().await;
}

#[tokio::test]
async fn repeated_report_counts_once_until_staff_clear_the_gait() {
    let (_folder, service) = service().await;
    let (study, code) = pair(&service).await;
    for _ in 0..2 {
        assert_eq!(rate(&service, &code, "unsafe_first").await.status, StatusCode::OK);
    }
    let reports = service.fetch(&format!("/api/v1/studies/{study}/safety-reports")).await.items();
    assert_eq!(reports.as_array().unwrap().len(), 1, "{reports}");
    let gait = reports[0]["trial_id"].as_str().unwrap().to_owned();
    let review = json!({"decision": "cleared", "reason": "seen again", "reports": [reports[0]["id"]]});
    assert_eq!(
        service.post(&format!("/api/v1/trials/{gait}/safety-reviews"), &review).await.status,
        StatusCode::CREATED
    );
    assert!(closed(&service, study).await.is_empty());
    assert_eq!(rate(&service, &code, "unsafe_first").await.status, StatusCode::OK);
    assert_eq!(closed(&service, study).await, BTreeSet::from([gait.clone()]));
    assert_eq!(rate(&service, &code, "unsafe_both").await.status, StatusCode::OK);
    let both = closed(&service, study).await;
    assert_eq!(both.len(), 2);
    clear(&service, &gait).await;
    assert_eq!(rate(&service, &code, "unsafe_both").await.status, StatusCode::OK);
    assert_eq!(closed(&service, study).await, both, "also if only one of two gaits was cleared");
    service.stop().await;
}

#[tokio::test]
async fn comparison_form_reports_a_gait_after_another_answer() {
    let (_folder, service) = service().await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (6, AnswerSource::People)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let trials = converged(&service, study).await;
    let [a, b] = [trials[0].id, trials[1].id];
    let key = FeedbackId::fresh();
    let send = async |answer: &str| {
        let form = format!("a={a}&b={b}&answer={answer}&source=clinician&author=K&note=&key={key}");
        service.post_text(&format!("/studies/{study}/compare"), FORM, &form).await.status
    };
    assert_eq!(send("a").await, StatusCode::SEE_OTHER);
    assert_eq!(send("b").await, StatusCode::CONFLICT);
    for _ in 0..2 {
        assert_eq!(send("unsafe_a").await, StatusCode::SEE_OTHER);
    }
    assert_eq!(closed(&service, study).await, names(&[a]));
    let reports = service.fetch(&format!("/api/v1/studies/{study}/safety-reports")).await.items();
    assert_eq!(reports.as_array().unwrap().len(), 1, "the same form, sent twice, counts once: {reports}");
    for _ in 0..2 {
        clear(&service, &a.to_string()).await;
        assert_eq!(send("unsafe_a").await, StatusCode::SEE_OTHER);
        assert_eq!(closed(&service, study).await, names(&[a]), "after a review it is a new report");
    }
    service.stop().await;
}

struct Lab {
    study: StudyId,
    gaits: [TrialId; 2],
    id: String,
}

impl Lab {
    async fn planned(service: &Service) -> Self {
        let study = service.study(|new| new.number_of_trials = 12).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let trials = converged(service, study).await;
        let gaits = [trials[0].id, trials[1].id];
        let plan = json!({"trial_a": gaits[0], "trial_b": gaits[1]});
        let session = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &plan).await.json();
        Self { study, gaits, id: session["id"].as_str().unwrap().to_owned() }
    }

    async fn walked(service: &Service) -> Self {
        let lab = Self::planned(service).await;
        for walk in 1..=3 {
            assert_eq!(lab.post(service, "walks", &json!({"walk": walk})).await.status, StatusCode::OK);
        }
        lab
    }

    async fn post(&self, service: &Service, what: &str, body: &Value) -> Answer {
        service.post(&format!("/api/v1/lab-sessions/{}/{what}", self.id), body).await
    }

    async fn answer(&self, service: &Service, number: u32, answer: &str) -> StatusCode {
        self.post(service, "answers", &json!({"number": number, "answer": answer})).await.status
    }

    /// The gait of walk 2 or 3, from the record.
    async fn gait_of(&self, service: &Service, walk: u8) -> TrialId {
        let mut db = service.store.read().await.unwrap();
        let sessions = lab_sessions::of_study(&mut db, self.study).await.unwrap();
        let (second, third) = sessions[0].walked().unwrap();
        if walk == 2 { second } else { third }
    }
}

#[tokio::test]
async fn report_replaces_the_answer_of_a_blinded_session() {
    let (_folder, service) = service().await;
    let lab = Lab::walked(&service).await;
    assert_eq!(lab.answer(&service, 1, "first").await, StatusCode::OK);
    assert_eq!(lab.answer(&service, 1, "second").await, StatusCode::CONFLICT);
    let page = service.fetch(&format!("/lab/{}", lab.id)).await.text;
    assert!(page.contains("Report a walk as unsafe"), "{page}");
    let form = "number=2&answer=unsafe_second&note=fell";
    let sent = service.post_text(&format!("/lab/{}/answer", lab.id), FORM, form).await;
    assert_eq!(sent.status, StatusCode::SEE_OTHER, "{}", sent.text);
    assert_eq!(closed(&service, lab.study).await, names(&lab.gaits), "either gait may be meant");
    let page = service.fetch(&format!("/lab/{}", lab.id)).await.text;
    assert!(page.contains("A walk was reported as unsafe"), "{page}");
    // At unblinding it is about the gait of walk 3, and the answer before it does not count.
    assert_eq!(lab.post(&service, "unblind", &json!({"reason": "done"})).await.status, StatusCode::OK);
    assert_eq!(closed(&service, lab.study).await, names(&[lab.gait_of(&service, 3).await]));
    service.stop().await;
}

#[tokio::test]
async fn second_report_of_a_session_is_also_recorded() {
    let (_folder, service) = service().await;
    let lab = Lab::walked(&service).await;
    assert_eq!(lab.answer(&service, 1, "unsafe_first").await, StatusCode::OK);
    for again in ["unsafe_first", "unsafe_second", "unsafe_both"] {
        for gait in lab.gaits {
            clear(&service, &gait.to_string()).await;
        }
        assert_eq!(lab.answer(&service, 1, again).await, StatusCode::OK);
        assert_eq!(closed(&service, lab.study).await, names(&lab.gaits), "{again}");
    }
    let reports = service.fetch(&format!("/api/v1/studies/{}/safety-reports", lab.study)).await.items().to_string();
    assert!(reports.contains("the subject in lab session 1 (walk 3; blinded: it may be either gait)"), "{reports}");
    service.stop().await;
}

#[tokio::test]
async fn unsafe_walk_is_reported_after_the_session_closed() {
    let (_folder, service) = service().await;
    let lab = Lab::walked(&service).await;
    assert_eq!(lab.post(&service, "close", &json!({})).await.status, StatusCode::OK);
    assert_eq!(lab.answer(&service, 1, "first").await, StatusCode::CONFLICT);
    let page = service.fetch(&format!("/lab/{}", lab.id)).await.text;
    assert!(page.contains("Report a walk as unsafe"), "{page}");
    assert_eq!(lab.answer(&service, 1, "unsafe_first").await, StatusCode::OK);
    assert_eq!(closed(&service, lab.study).await, names(&lab.gaits));
    service.stop().await;
}

#[tokio::test]
async fn unsafe_walk_is_reported_after_answer_and_unblinding() {
    let (_folder, service) = service().await;
    let lab = Lab::walked(&service).await;
    assert_eq!(lab.answer(&service, 1, "first").await, StatusCode::OK);
    assert_eq!(lab.post(&service, "unblind", &json!({"reason": "done"})).await.status, StatusCode::OK);
    assert_eq!(lab.post(&service, "close", &json!({})).await.status, StatusCode::OK);
    assert_eq!(lab.answer(&service, 1, "unsafe_first").await, StatusCode::OK);
    assert_eq!(closed(&service, lab.study).await, names(&[lab.gait_of(&service, 2).await]));
    service.stop().await;
}

#[tokio::test]
async fn unsafe_walk_with_a_fetched_file_is_reported_before_a_walk_is_recorded() {
    let (_folder, service) = service().await;
    let lab = Lab::planned(&service).await;
    let offered = async || service.fetch(&format!("/lab/{}", lab.id)).await.text.contains("Report a walk as unsafe");
    assert!(!offered().await);
    let file = service.fetch(&format!("/api/v1/lab-sessions/{}/controller.json?walk=2", lab.id)).await;
    assert_eq!(file.status, StatusCode::OK, "{}", file.text);
    assert!(offered().await);
    assert_eq!(lab.answer(&service, 1, "unsafe_first").await, StatusCode::OK);
    assert_eq!(closed(&service, lab.study).await, names(&lab.gaits));
    service.stop().await;
}
