//! Safety reviews: staff decide on a safety report, with a reason, and the report stays in the record.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright_store::blind_pairs::{self, OrderedAnswer};
use gaitwright_store::safety_reviews::{self, SafetyDecision};
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_store::{Store, StudyId, TrialId, audit, lab_sessions};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers::FORM;
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use sqlx::SqlitePool;
use sqlx::sqlite::SqliteConnectOptions;

async fn started(source: AnswerSource, trials: u32) -> (tempfile::TempDir, Service, StudyId) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (trials, source)).await;
    service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await;
    (folder, service, study)
}

async fn converged(service: &Service, study: StudyId) -> Vec<TrialId> {
    let trials = service.trials(study).await;
    trials.iter().filter(|trial| trial.state == TrialState::Converged).map(|trial| trial.id).collect()
}

async fn safety_reports(service: &Service, study: StudyId) -> Vec<Value> {
    let all = service.fetch(&format!("/api/v1/studies/{study}/safety-reports")).await.items();
    all.as_array().unwrap().clone()
}

async fn decide(service: &Service, trial: impl std::fmt::Display, decision: &Value) -> Answer {
    service.post(&format!("/api/v1/trials/{trial}/safety-reviews"), decision).await
}

async fn waits_at_home(service: &Service) -> bool {
    service.fetch("/").await.text.contains("1 gait reported as unsafe")
}

#[tokio::test]
async fn staff_clear_a_rater_report_and_it_stays_in_the_record() {
    let (_folder, service, study) = started(AnswerSource::People, 4).await;
    let pair = service.post(&format!("/api/v1/studies/{study}/blind-pairs/next"), &json!({})).await.json();
    let answer = format!("/api/v1/blind-pairs/{}/answer", pair["pair"]["code"].as_str().unwrap());
    assert_eq!(service.post(&answer, &json!({"answer": "unsafe_second"})).await.status, StatusCode::OK);
    let said = safety_reports(&service, study).await;
    assert_eq!(said.len(), 1, "{said:?}");
    assert_eq!((&said[0]["in_force"], &said[0]["review"]), (&json!(true), &Value::Null));
    let gait = said[0]["trial_id"].as_str().unwrap().to_owned();
    let page = service.fetch(&format!("/trials/{gait}")).await.text;
    assert!(page.contains("Do not walk with it") && page.contains("Safety review"), "{page}");
    assert!(waits_at_home(&service).await);

    // It stays unsafe: nobody needs to look again, and it can still be lifted.
    let stays =
        decide(&service, &gait, &json!({"decision": "unsafe", "reason": "the knee buckles", "author": "K1"})).await;
    assert_eq!((stays.status, &stays.json()["decision"]), (StatusCode::CREATED, &json!("unsafe")));
    assert!(!waits_at_home(&service).await);
    let shown = service.fetch(&format!("/trials/{gait}")).await.text;
    assert!(
        shown.contains(
            "K1 reviewed the report and decided that the gait should remain marked as unsafe: <q>the knee buckles</q>"
        ),
        "{shown}"
    );
    let feedback = service.feedback(study).await;
    assert!(feedback.iter().all(|row| row.retraction.is_none()));

    let walkable = json!({"decision": "cleared", "reason": "the video was cut", "author": "K2"});
    assert_eq!(decide(&service, &gait, &walkable).await.status, StatusCode::CREATED);
    let said = safety_reports(&service, study).await;
    assert_eq!((&said[0]["in_force"], &said[0]["review"]["reason"]), (&json!(false), &json!("the video was cut")));
    let shown = service.fetch(&format!("/trials/{gait}")).await.text;
    assert!(!shown.contains("Do not walk with it") && shown.contains("cleared the gait for walking"), "{shown}");
    // The answer of the rater is unchanged, and does not imply that the other gait is better.
    let mut reader = service.store.read().await.unwrap();
    // On which side it was shown is drawn anew each time; the record has it as said of the pair.
    let shown = blind_pairs::of_study(&mut reader, study).await.unwrap().remove(0);
    let called_unsafe =
        shown.answer.filter(|said| *said != OrderedAnswer::UnsafeBoth).map(|said| said.unsafe_of(shown.trials()));
    assert_eq!(called_unsafe, Some(vec![gait.parse().unwrap()]));
    let trail = audit::page(&mut reader, "", None, 100).await.unwrap();
    drop(reader);
    let reviews: Vec<_> = trail.iter().filter(|row| row.change == "gait.review").collect();
    assert_eq!(reviews.len(), 2);
    assert!(reviews.iter().any(|row| row.detail.to_string().contains("the video was cut")));
    let feedback = service.feedback(study).await;
    let retracted: Vec<_> = feedback.iter().filter_map(|row| row.retraction.as_ref()).collect();
    assert_eq!(
        retracted.iter().map(|why| (why.author.as_str(), why.reason.as_str())).collect::<Vec<_>>(),
        [("K2", "the video was cut")]
    );
    // The pair can be compared again.
    service.wait_for(study, &[StudyState::Waiting]).await;
    let again = service.post(&format!("/api/v1/studies/{study}/blind-pairs/next"), &json!({})).await.json();
    assert!(again["pair"].is_object(), "{again}");
    service.stop().await;
}

#[tokio::test]
async fn gait_cleared_by_staff_is_recommended_again() {
    let (_folder, service, study) = started(AnswerSource::GaitRmse, 6).await;
    let recommended = async || service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await.json();
    let best = recommended().await["trial_id"].clone();
    let other = converged(&service, study).await.into_iter().find(|id| json!(id) != best).unwrap();
    let assessment = json!({"trial_a": best, "trial_b": other, "answer": "unsafe_a", "author": "K1"});
    let address = format!("/api/v1/studies/{study}/assessments");
    service.post(&address, &assessment).await;
    assert_ne!(recommended().await["trial_id"], best);
    let best_id = best.as_str().unwrap();
    let for_the_device = service.fetch(&format!("/api/v1/trials/{best_id}/controller.json")).await;
    assert_eq!(for_the_device.status, StatusCode::CONFLICT);
    assert!(for_the_device.text.contains("Do not walk with it until"), "{}", for_the_device.text);
    let seen = safety_reports(&service, study).await[0]["id"].clone();
    service.post(&address, &json!({"trial_a": best, "trial_b": other, "answer": "unsafe_a", "author": "K3"})).await;
    let late = decide(&service, best_id, &json!({"decision": "cleared", "reason": "r", "reports": [seen]})).await;
    assert_eq!(late.status, StatusCode::CONFLICT);
    assert!(late.text.contains("a safety report by K3 that is not among"), "{}", late.text);

    // By the form, which sends the reports on its page.
    let page = service.fetch(&format!("/trials/{best_id}")).await.text;
    let seen = page.split("name=\"reports\" value=\"").nth(1).unwrap().split('"').next().unwrap();
    let form = format!("decision=cleared&author=K2&reason=tried+slowly&reports={}", seen.replace(',', "%2C"));
    let sent = service.post_text(&format!("/trials/{best_id}/safety-review"), FORM, &form).await;
    assert_eq!(sent.status, StatusCode::SEE_OTHER, "{}", sent.text);
    assert_eq!(recommended().await["trial_id"], best);
    let for_the_device = service.fetch(&format!("/api/v1/trials/{best_id}/controller.json")).await;
    assert_ne!(
        for_the_device.status,
        StatusCode::CONFLICT,
        "what the analytic solver gives is no gait, but that is all"
    );
    let study_page = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(study_page.contains("cleared for walking by K2: tried slowly"), "{study_page}");
    let twice = decide(&service, best_id, &json!({"decision": "cleared", "reason": "r"})).await;
    assert_eq!(twice.status, StatusCode::CONFLICT);
    for (decision, field) in [
        (json!({"decision": "cleared", "reason": " "}), "reason"),
        (json!({"decision": "cleared", "reason": "r", "author": ""}), "author"),
    ] {
        let refused = decide(&service, best_id, &decision).await;
        assert_eq!((refused.status, &refused.json()["field"]), (StatusCode::UNPROCESSABLE_ENTITY, &json!(field)));
    }
    service.stop().await;
}

#[tokio::test]
async fn cleared_report_of_a_walk_needs_another_review_after_unblinding() {
    let (_folder, service, study) = started(AnswerSource::GaitRmse, 6).await;
    let gaits = converged(&service, study).await;
    let sessions = format!("/api/v1/studies/{study}/lab-sessions");
    let plan = json!({"trial_a": gaits[0], "trial_b": gaits[1]});
    let id = service.post(&sessions, &plan).await.json()["id"].as_str().unwrap().to_owned();
    for walk in 1..=3 {
        service.post(&format!("/api/v1/lab-sessions/{id}/walks"), &json!({"walk": walk})).await;
    }
    service.post(&format!("/api/v1/lab-sessions/{id}/answers"), &json!({"number": 1, "answer": "unsafe_first"})).await;
    assert_eq!(safety_reports(&service, study).await.len(), 2, "which of the two would tell the order");
    for gait in &gaits[..2] {
        let lifted =
            decide(&service, gait, &json!({"decision": "cleared", "reason": "he stumbled over a cable"})).await;
        assert_eq!(lifted.status, StatusCode::CREATED, "{}", lifted.text);
    }
    let planned = service.post(&sessions, &plan).await;
    assert_eq!(planned.status, StatusCode::CREATED, "{}", planned.text);
    tokio::time::sleep(std::time::Duration::from_millis(2)).await;
    service.post(&format!("/api/v1/lab-sessions/{id}/unblind"), &json!({"reason": "walked"})).await;
    let row = lab_sessions::of_study(&mut service.store.read().await.unwrap(), study).await.unwrap().remove(0);
    let mut snapshot = safety_reports(&service, study).await;
    snapshot.retain(|report| report["in_force"] == json!(true));
    assert_eq!(snapshot.iter().map(|said| &said["trial_id"]).collect::<Vec<_>>(), [&json!(row.walked().unwrap().0)]);
    service.stop().await;
}

#[tokio::test]
async fn renumbered_rows_keep_the_order_of_reviews() {
    let (_folder, service, study) = started(AnswerSource::GaitRmse, 4).await;
    let gait = converged(&service, study).await[0];
    service.post(&format!("/api/v1/trials/{gait}/safety-reports"), &json!({"note": "stumbled"})).await;
    for decision in ["unsafe", "cleared"] {
        let reviewed = decide(&service, gait, &json!({"decision": decision, "reason": "seen"})).await;
        assert_eq!(reviewed.status, StatusCode::CREATED, "{}", reviewed.text);
    }
    let path = service.store.path().to_owned();
    service.stop().await;
    let pool = SqlitePool::connect_with(SqliteConnectOptions::new().filename(&path)).await.unwrap();
    let trigger = "select sql from sqlite_master where name = 'safety_reviews_no_update'";
    let trigger: String = sqlx::query_scalar(trigger).fetch_one(&pool).await.unwrap();
    for sql in ["drop trigger safety_reviews_no_update", "update safety_reviews set rowid = -rowid", &trigger] {
        sqlx::query(sqlx::AssertSqlSafe(sql.to_owned())).execute(&pool).await.unwrap();
    }
    pool.close().await;
    let store = Store::open(&path).await.unwrap();
    let reviews = safety_reviews::of_study(&mut store.read().await.unwrap(), study).await.unwrap();
    let decisions: Vec<_> = reviews.iter().map(|review| review.decision).collect();
    assert_eq!(decisions, [SafetyDecision::Unsafe, SafetyDecision::Cleared]);
    store.close().await;
}
