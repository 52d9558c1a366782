//! Blind comparisons: what a rater is shown, what is recorded, and that nothing says which gait is which.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright::store::presentations::{self, Kind, Presentation};
use gaitwright::store::studies::{FeedbackMode, StudyState};
use gaitwright::store::{StudyId, audit};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};
use tempfile::TempDir;

async fn waiting(trials: u32) -> (TempDir, Service, StudyId) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.feedback_mode, new.trial_budget) = (FeedbackMode::Human, trials)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    (folder, service, study)
}

async fn next(service: &Service, study: StudyId) -> Value {
    let answer = service.post(&format!("/api/v1/studies/{study}/blind/next"), &json!({})).await;
    assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
    answer.json()["pair"].clone()
}

async fn say(service: &Service, pair: &Value, answer: &str) -> StatusCode {
    let path = format!("/api/v1/blind/{}/answer", pair["token"].as_str().unwrap());
    service.post(&path, &json!({"answer": answer, "response_ms": 900})).await.status
}

async fn shown(service: &Service, study: StudyId) -> Vec<Presentation> {
    presentations::of_study(&mut service.store.read().await.unwrap(), study).await.unwrap()
}

#[tokio::test]
async fn nothing_that_a_rater_gets_says_which_gait_it_is() {
    let (_folder, service, study) = waiting(4).await;
    let pair = next(&service, study).await;
    let token = pair["token"].as_str().unwrap();
    let mut bytes = pair.to_string();
    for path in [
        "/rate".to_owned(),
        format!("/rate/pair/{token}"),
        format!("/api/v1/blind/{token}/first"),
        format!("/api/v1/blind/{token}/second"),
    ] {
        let answer = service.fetch(&path).await;
        assert_eq!(answer.status, StatusCode::OK, "{path}: {}", answer.text);
        if path.contains("/blind/") {
            // Positions and nothing else.
            assert!(answer.text.chars().all(|c| "[]-.,0123456789".contains(c)), "{}", answer.text);
            continue;
        }
        bytes.push_str(&answer.text);
        for (name, value) in &answer.headers {
            bytes.push_str(name.as_str());
            bytes.push_str(value.to_str().unwrap());
        }
    }
    let taken = service.post_text(&format!("/rate/{study}"), "application/x-www-form-urlencoded", "").await;
    assert_eq!(taken.headers["location"], format!("/rate/pair/{token}"), "the same pair until it is answered");
    for trial in service.trials(study).await {
        for secret in [
            trial.id.to_string(),
            trial.id.short(),
            serde_json::to_string(&trial.action).unwrap(),
            trial.gait_rmse_rad.map_or("no figure".to_owned(), |rmse| format!("{rmse:.4}")),
            trial.gait_rmse_rad.map_or("no figure".to_owned(), |rmse| rmse.to_string()),
            trial.cost_of_transport.map_or("no figure".to_owned(), |cost| format!("{cost:.4}")),
        ] {
            assert!(!bytes.contains(&secret), "{secret}");
        }
    }
    let words = bytes.to_lowercase();
    for word in ["trial", "rmse", "bound", "converged", "\"a1\"", "0.026", "stride_", ".csv", ".json", "seed"] {
        assert!(!words.contains(word), "{word}");
    }
    // As long, as many figures, the same start.
    let motion = |side: &str| {
        let path = format!("/api/v1/blind/{token}/{side}");
        let service = &service;
        async move { service.fetch(&path).await.json() }
    };
    let (first, second) = (motion("first").await, motion("second").await);
    assert_eq!(first.as_array().unwrap().len(), 101);
    assert_eq!(second.as_array().unwrap().len(), 101);
    assert_eq!((first[0][0][0].as_f64(), second[0][0][0].as_f64()), (Some(0.0), Some(0.0)));
    service.stop().await;
}

#[tokio::test]
async fn a_study_is_rated_to_its_end_and_controls_are_not_heard() {
    let (_folder, service, study) = waiting(40).await;
    for _ in 0..4000 {
        let present = service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await;
        if present.state == StudyState::Finished {
            break;
        }
        let pair = next(&service, study).await;
        if pair.is_null() {
            // The answer that was just given is being taken in.
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            continue;
        }
        assert_eq!(say(&service, &pair, "first").await, StatusCode::CREATED);
        assert_eq!(say(&service, &pair, "second").await, StatusCode::CONFLICT, "one answer per pair");
    }
    service.wait_for(study, &[StudyState::Finished]).await;
    let shown = shown(&service, study).await;
    let count = |kind| shown.iter().filter(|p| p.kind == kind).count();
    let heard = service.feedback(study).await.iter().filter(|row| row.source.as_str() == "clinician").count();
    assert_eq!(heard, count(Kind::New), "of {} pairs", shown.len());
    assert!(count(Kind::Repeat) + count(Kind::Null) > 0, "controls were shown");

    let figures = service.fetch(&format!("/api/v1/studies/{study}/raters")).await.json();
    assert_eq!(figures[0]["first_preferred"]["share"], 1.0, "this rater always says first");
    assert_eq!(figures[0]["nulls_without_difference"]["count"], 0);
    if count(Kind::Repeat) > 0 {
        assert_eq!(figures[0]["repeats_agree"]["count"], 0, "always first disagrees with itself on swapped sides");
    }
    service.stop().await;
}

#[tokio::test]
async fn a_watch_does_not_tell_a_control_the_next_pair_is_waited_for_as_after_a_question() {
    let folder = tempfile::tempdir().unwrap();
    let slow = Analytic::slow(std::time::Duration::from_millis(60));
    let service = Service::start(&folder.path().join("a.db"), slow, 1).await;
    let study = service.study(|new| (new.feedback_mode, new.trial_budget) = (FeedbackMode::Human, 40)).await;
    let (mut controls, mut held) = (0, 0);
    for _ in 0..4000 {
        let present = service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await;
        if present.state == StudyState::Finished {
            break;
        }
        let pair = next(&service, study).await;
        if pair.is_null() {
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            continue;
        }
        assert_eq!(say(&service, &pair, "second").await, StatusCode::CREATED);
        if shown(&service, study).await.last().unwrap().kind != Kind::New {
            controls += 1;
            held += u32::from(next(&service, study).await.is_null());
        }
    }
    service.wait_for(study, &[StudyState::Finished]).await;
    // Solves that were prepared make some waits as short as a request.
    assert!(held > 0 && 2 * held >= controls, "{held} of {controls}");
    service.stop().await;
}

#[tokio::test]
async fn skipped_pairs_are_not_asked_again_and_unsafe_gaits_are_not_shown_again() {
    let (_folder, service, study) = waiting(12).await;
    let mut unsafe_trial = None;
    let mut turn = 0;
    for _ in 0..4000 {
        let present = service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await;
        if present.state == StudyState::Finished {
            break;
        }
        let pair = next(&service, study).await;
        if pair.is_null() {
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            continue;
        }
        let last = shown(&service, study).await.pop().unwrap();
        if let Some(closed) = unsafe_trial {
            assert!(last.shown_first != closed && last.shown_second != closed, "an unsafe gait was shown again");
        }
        let word = if turn == 0 {
            "cannot_tell"
        } else if unsafe_trial.is_none() && last.kind == Kind::New {
            unsafe_trial = Some(last.shown_second);
            "unsafe_second"
        } else {
            "no_difference"
        };
        assert_eq!(say(&service, &pair, word).await, StatusCode::CREATED);
        turn += 1;
    }
    service.wait_for(study, &[StudyState::Finished]).await;
    assert!(unsafe_trial.is_some());
    let shown = shown(&service, study).await;
    let skipped = (shown[0].shown_first, shown[0].shown_second);
    let again = shown[1..].iter().filter(|p| {
        let pair = (p.shown_first, p.shown_second);
        p.kind == Kind::New && (pair == skipped || pair == (skipped.1, skipped.0))
    });
    assert_eq!(again.count(), 0);
    service.stop().await;
}

#[tokio::test]
async fn unblinding_needs_a_reason_is_an_act_and_marks_what_follows() {
    let (_folder, service, study) = waiting(6).await;
    let pair = next(&service, study).await;
    assert_eq!(say(&service, &pair, "second").await, StatusCode::CREATED);
    let path = format!("/api/v1/studies/{study}/unblind");
    let rater = "not signed in";
    let refused = service.post(&path, &json!({"rater": rater, "reason": " "})).await;
    assert_eq!(refused.json()["field"], "reason");
    let unknown = service.post(&path, &json!({"rater": "nobody", "reason": "r"})).await;
    assert_eq!(unknown.json()["field"], "rater");
    let told = service.post(&path, &json!({"rater": rater, "reason": "adverse event"})).await;
    assert_eq!(told.status, StatusCode::OK);
    assert_eq!(told.json()[0]["shown_first"], json!(shown(&service, study).await[0].shown_first));
    assert!(!told.text.contains(pair["token"].as_str().unwrap()));
    let rows = audit::page(&mut service.store.read().await.unwrap(), "", None, 1).await.unwrap();
    assert_eq!((rows[0].action.as_str(), &rows[0].detail["reason"]), ("study.unblind", &json!("adverse event")));
    loop {
        service.wait_for(study, &[StudyState::Waiting]).await;
        if !next(&service, study).await.is_null() {
            break;
        }
    }
    let shown = shown(&service, study).await;
    assert_eq!(shown.iter().map(|p| p.unblinded).collect::<Vec<_>>(), [false, true]);
    service.stop().await;
}

#[tokio::test]
async fn the_last_answer_can_be_taken_back_once_and_counts_no_more() {
    const FORM: &str = "application/x-www-form-urlencoded";
    let (_folder, service, study) = waiting(6).await;
    let pair = next(&service, study).await;
    let at = |pair: &Value, what: &str| format!("/rate/pair/{}{what}", pair["token"].as_str().unwrap());
    assert_eq!(say(&service, &pair, "first").await, StatusCode::CREATED);
    let heard = |rows: &[gaitwright::store::feedback::FeedbackRow]| {
        rows.iter().filter(|row| row.source.as_str() == "clinician" && row.retraction.is_none()).count()
    };
    assert_eq!(heard(&service.feedback(study).await), 1);
    let back = service.post_text(&at(&pair, "/take-back"), FORM, "").await;
    assert_eq!(back.status, StatusCode::SEE_OTHER, "{}", back.text);
    assert_eq!(heard(&service.feedback(study).await), 0);
    let figures = service.fetch(&format!("/api/v1/studies/{study}/raters")).await.json();
    assert_eq!((&figures[0]["shown"], &figures[0]["answered"]), (&json!(1), &json!(0)), "{figures}");
    assert_eq!(service.post_text(&at(&pair, "/take-back"), FORM, "").await.status, StatusCode::CONFLICT);

    // Neither what is not the last answer, nor that a gait is unsafe.
    let mut pairs = Vec::new();
    while pairs.len() < 2 {
        service.wait_for(study, &[StudyState::Waiting]).await;
        let pair = next(&service, study).await;
        if !pair.is_null() {
            let answer = if pairs.is_empty() { "cannot_tell" } else { "unsafe_second" };
            assert_eq!(say(&service, &pair, answer).await, StatusCode::CREATED);
            pairs.push(pair);
        }
    }
    for pair in &pairs {
        let refused = service.post_text(&at(pair, "/take-back"), FORM, "").await;
        assert_eq!(refused.status, StatusCode::CONFLICT, "{}", refused.text);
    }
    service.stop().await;
}
