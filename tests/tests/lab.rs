//! Lab sessions: the allocation is drawn, concealed, and revealed by unblinding only; walks are recorded in order.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_optimizer::emg::EmgSettings;
use gaitwright_service::studies::identical_gaits::is_same_gait;
use gaitwright_service::studies::lab;
use gaitwright_service::workers::Evaluate;
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow, Source};
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{LabSessionId, Store, StudyId, audit, lab_sessions};
use gaitwright_tests::analytic::{Analytic, inactive_bound};
use gaitwright_tests::archives::{exported, import};
use gaitwright_tests::consistent_gaits::Consistent;
use gaitwright_tests::measured::{electromyogram, joint_angles};
use gaitwright_tests::read_allocations::gait_a_first;
use gaitwright_tests::service::Service;
use gaitwright_tests::well_formed::WellFormed;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write;
use tempfile::TempDir;

const FORM: &str = "application/x-www-form-urlencoded";

async fn finished() -> (TempDir, Service, StudyId, Vec<Trial>) {
    finished_by(Analytic::default()).await
}

async fn finished_by(solver: impl Evaluate) -> (TempDir, Service, StudyId, Vec<Trial>) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let study = service.study(|new| new.number_of_trials = 24).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    (folder, service, study, trials)
}

fn converged(trials: &[Trial]) -> Vec<&Trial> {
    trials.iter().filter(|trial| trial.state == TrialState::Converged).collect()
}

async fn planned(service: &Service, study: StudyId, trials: &[Trial]) -> Value {
    let gaits = converged(trials);
    let body = json!({"trial_a": gaits[0].id, "trial_b": gaits[1].id, "notes": "treadmill"});
    let planned = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &body).await;
    assert_eq!(planned.status, StatusCode::CREATED, "{}", planned.text);
    planned.json()
}

fn id(session: &Value) -> &str {
    session["id"].as_str().unwrap()
}

#[tokio::test]
async fn lab_session_records_walks_in_order_closes_and_is_unblinded() {
    let (_folder, service, study, trials) = finished().await;
    let session = planned(&service, study, &trials).await;
    let api = format!("/api/v1/lab-sessions/{}", id(&session));
    assert_eq!((&session["state"], &session["number"]), (&json!("planned"), &json!(1)));
    let conditions = |session: &Value| -> Vec<Value> {
        session["walks"].as_array().unwrap().iter().map(|walk| walk["condition"].clone()).collect()
    };
    assert_eq!(conditions(&session), [json!("normal"), Value::Null, Value::Null]);

    for (walk, status) in [
        (2, StatusCode::CONFLICT),
        (0, StatusCode::UNPROCESSABLE_ENTITY),
        (4, StatusCode::UNPROCESSABLE_ENTITY),
        (1, StatusCode::OK),
        (1, StatusCode::CONFLICT),
        (2, StatusCode::OK),
    ] {
        let walked = service.post(&format!("{api}/walks"), &json!({"walk": walk})).await;
        assert_eq!(walked.status, status, "walk {walk}: {}", walked.text);
    }
    assert_eq!(service.fetch(&format!("{api}/next-walk")).await.json()["walk"], 3);
    assert_eq!(service.fetch(&api).await.json()["state"], "under_way");

    let without = service.post(&format!("{api}/unblind"), &json!({"reason": " "})).await;
    assert_eq!(without.json()["field"], "reason");
    let told = service.post(&format!("{api}/unblind"), &json!({"reason": "adverse event"})).await;
    assert_eq!(told.status, StatusCode::OK, "{}", told.text);
    assert_eq!(service.post(&format!("{api}/unblind"), &json!({"reason": "r"})).await.status, StatusCode::CONFLICT);
    service.post(&format!("{api}/walks"), &json!({"walk": 3, "note": "tired"})).await;
    let told = service.fetch(&api).await.json();
    let row: LabSessionId = id(&session).parse().unwrap();
    let drawn = if gait_a_first(&service.store, row).await { ["gait_a", "gait_b"] } else { ["gait_b", "gait_a"] };
    assert_eq!(conditions(&told), [json!("normal"), json!(drawn[0]), json!(drawn[1])]);
    let after: Vec<_> =
        told["walks"].as_array().unwrap().iter().map(|walk| &walk["recorded_after_unblinding"]).collect();
    assert_eq!(after, [&json!(false), &json!(false), &json!(true)]);
    assert_eq!(told["walks"][2]["recorded"]["note"], "tired");

    assert_eq!(service.post(&format!("{api}/close"), &json!({"note": "done"})).await.json()["state"], "closed");
    assert_eq!(service.post(&format!("{api}/close"), &json!({})).await.status, StatusCode::CONFLICT);
    assert!(service.fetch(&format!("{api}/next-walk")).await.json()["walk"].is_null());
    let trail = audit::page(&mut service.store.read().await.unwrap(), "", None, 6).await.unwrap();
    let acts: Vec<_> = trail.iter().map(|row| row.change.trim_start_matches("lab_session.")).collect();
    assert_eq!(acts, ["close", "record_walk", "unblind", "record_walk", "record_walk", "plan"]);
    service.stop().await;
}

fn without_times(page: &str) -> String {
    let mut parts = page.split("<time");
    let first = parts.next().unwrap().to_owned();
    parts.fold(first, |text, part| text + part.split_once("</time>").unwrap().1)
}

#[tokio::test]
async fn lab_session_reveals_no_gait_before_unblinding() {
    let (_folder, service, study, trials) = finished().await;
    let session = planned(&service, study, &trials).await;
    let mut bytes = String::new();
    for path in [
        "/lab".to_owned(),
        format!("/lab/{}", id(&session)),
        format!("/api/v1/lab-sessions/{}/next-walk", id(&session)),
    ] {
        let answer = service.fetch(&path).await;
        assert_eq!(answer.status, StatusCode::OK, "{path}: {}", answer.text);
        bytes.push_str(&answer.text);
        bytes.extend(answer.headers.values().map(|value| value.to_str().unwrap().to_owned()));
    }
    assert!(bytes.contains("Walk 1") && bytes.contains(id(&session)));
    let words = bytes.to_lowercase();
    for word in ["trial", "rmse", "gait_", "gait A", "gait B", "treadmill", "seed", "controller", &study.to_string()] {
        assert!(!words.contains(word), "{word}");
    }
    for trial in &trials {
        assert!(!bytes.contains(&trial.id.to_string()) && !bytes.contains(&trial.id.short()));
    }
    // Two sessions that differ only in their allocation look the same to every reader.
    let mut seen = Vec::new();
    while seen.len() < 4 || seen.iter().all(|(order, _)| *order) || seen.iter().all(|(order, _)| !*order) {
        let session = planned(&service, study, &trials).await;
        let lab = format!("/api/v1/lab-sessions/{}", id(&session));
        for walk in 1..=3 {
            service.post(&format!("{lab}/walks"), &json!({"walk": walk})).await;
        }
        service.post(&format!("{lab}/answers"), &json!({"number": 1, "answer": "second"})).await;
        let order = gait_a_first(&service.store, id(&session).parse().unwrap()).await;
        let page = service.fetch(&format!("/lab-sessions/{}", id(&session))).await.text;
        let code = &id(&session)[id(&session).len() - 8..];
        let page = page
            .replace(id(&session), "ID")
            .replace(code, "CODE")
            .replace(&format!("session {}", session["number"]), "session N");
        seen.push((order, without_times(&page)));
    }
    assert!(seen.iter().all(|(_, page)| *page == seen[0].1), "{seen:?}");
    service.stop().await;
}

#[tokio::test]
async fn each_walk_gets_the_controller_file_of_its_own_gait() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), WellFormed::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 24).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let gaits = converged(&trials);
    // The content that drives the device; other parts of a file may name the walk.
    let moves = async |path: String| {
        let file = service.fetch(&path).await;
        assert_eq!(file.status, StatusCode::OK, "{path}: {}", file.text);
        let file = file.json();
        assert!(file["domains"].is_array() && file["trajectory"].is_object(), "{file}");
        (file["domains"].clone(), file["trajectory"].clone())
    };
    let one = moves(format!("/api/v1/trials/{}/controller.json", gaits[0].id)).await;
    let two = moves(format!("/api/v1/trials/{}/controller.json", gaits[1].id)).await;
    assert!(one.0 != two.0 && one.1 != two.1, "the gaits cannot be told apart");
    let mut orders = BTreeSet::new();
    for _ in 0..64 {
        let session = planned(&service, study, &trials).await;
        let api = format!("/api/v1/lab-sessions/{}", id(&session));
        let walks = [2, 3].map(|walk| format!("{api}/controller.json?walk={walk}"));
        let [second, third] = walks;
        let sent = [moves(second).await, moves(third).await];
        let none = service.fetch(&format!("{api}/controller.json?walk=1")).await;
        assert_eq!(none.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", none.text);
        assert!(none.text.contains("without the device"), "{}", none.text);
        let told = service.post(&format!("{api}/unblind"), &json!({"reason": "a test"})).await.json();
        let expected = [1, 2].map(|place| match told["walks"][place]["condition"].as_str() {
            Some("gait_a") => one.clone(),
            Some("gait_b") => two.clone(),
            other => panic!("{other:?}"),
        });
        assert!(sent == expected, "the order is {}", told["walks"]);
        orders.insert(sent[0] == one);
        if orders.len() == 2 {
            break;
        }
    }
    assert_eq!(orders.len(), 2, "one order alone was tried");
    service.stop().await;
}

async fn walked(service: &Service, study: StudyId, trials: &[Trial]) -> (String, String) {
    let session = planned(service, study, trials).await;
    let lab = format!("/api/v1/lab-sessions/{}", id(&session));
    let early = service.post(&format!("{lab}/answers"), &json!({"number": 1, "answer": "first"})).await;
    assert!(
        early.status == StatusCode::CONFLICT && early.text.contains("Walk 1 is not recorded yet"),
        "{}",
        early.text
    );
    for walk in 1..=3 {
        service.post(&format!("{lab}/walks"), &json!({"walk": walk})).await;
    }
    (lab, format!("/api/v1/lab-sessions/{}", id(&session)))
}

/// The answers of people, as the learner received them.
async fn subject_answers(service: &Service, study: StudyId) -> Vec<FeedbackRow> {
    let mut rows = service.feedback(study).await;
    rows.retain(|row| row.source == Source::Subject);
    rows
}

#[tokio::test]
async fn subject_preference_reaches_the_learner_after_unblinding() {
    let (_folder, service, study, trials) = finished().await;
    let (lab, session) = walked(&service, study, &trials).await;
    assert_eq!(service.fetch(&format!("{lab}/next-walk")).await.json()["answer_number"], 1);
    let answers = format!("{lab}/answers");
    for (body, status) in [
        (json!({"number": 1, "answer": "retracted"}), StatusCode::UNPROCESSABLE_ENTITY),
        (json!({"number": 0, "answer": "first"}), StatusCode::UNPROCESSABLE_ENTITY),
        (json!({"number": 2, "answer": "first"}), StatusCode::UNPROCESSABLE_ENTITY),
        (json!({"number": 1, "answer": "first"}), StatusCode::OK),
        // An answer that is sent twice counts once; a different one does not replace it.
        (json!({"number": 1, "answer": "first"}), StatusCode::OK),
        (json!({"number": 1, "answer": "second"}), StatusCode::CONFLICT),
    ] {
        let said = service.post(&answers, &body).await;
        assert_eq!(said.status, status, "{body}: {}", said.text);
        if body["answer"] == "retracted" {
            let allowed = "one of first, second, no_difference, cannot_tell, unsafe_first, unsafe_second, unsafe_both";
            assert_eq!(said.json()["allowed"], allowed, "{}", said.text);
        }
    }
    let back = service.post(&format!("{lab}/retract-answer"), &json!({})).await.json();
    assert_eq!((&back["answer_number"], &back["answer"]), (&json!(2), &Value::Null));
    let said = json!({"number": 2, "answer": "second", "note": "softer"});
    let seen = service.post(&answers, &said).await.json();
    assert_eq!((&seen["answer"]["answer"], &seen["can_be_retracted"]), (&json!("second"), &json!(true)));
    assert!(subject_answers(&service, study).await.is_empty(), "before unblinding");

    service.post(&format!("{session}/unblind"), &json!({"reason": "all were walked"})).await;
    let rows = subject_answers(&service, study).await;
    let row = lab_sessions::of_study(&mut service.store.read().await.unwrap(), study).await.unwrap().remove(0);
    let (first, second) = row.walked().unwrap();
    assert_eq!(
        rows.iter().map(|row| row.content).collect::<Vec<_>>(),
        [FeedbackContent::Preference { winner: second, loser: first }]
    );
    let pseudonym = service.fetch(&format!("/api/v1/studies/{study}")).await.json()["subject_id"].clone();
    let pseudonym = service.fetch(&format!("/api/v1/subjects/{}", pseudonym.as_str().unwrap())).await.json();
    assert_eq!((json!(rows[0].author), rows[0].note.as_str()), (pseudonym["pseudonym"].clone(), "softer"));
    assert_eq!(service.post(&format!("{lab}/retract-answer"), &json!({})).await.status, StatusCode::CONFLICT);
    service.stop().await;
}

#[tokio::test]
async fn unsafe_walk_excludes_both_gaits_until_unblinding() {
    let (_folder, service, study, trials) = finished().await;
    let (lab, session) = walked(&service, study, &trials).await;
    let said = json!({"number": 1, "answer": "unsafe_second", "note": "stumbled"});
    assert_eq!(service.post(&format!("{lab}/answers"), &said).await.status, StatusCode::OK);
    assert_eq!(service.post(&format!("{lab}/retract-answer"), &json!({})).await.status, StatusCode::CONFLICT);
    let gaits = converged(&trials);
    let closed = async || {
        let mut closed = Vec::new();
        for gait in &gaits[..2] {
            let page = service.fetch(&format!("/trials/{}", gait.id)).await.text;
            closed.push(page.contains("Do not walk with it"));
        }
        closed
    };
    assert_eq!(closed().await, [true, true]);
    let pair = json!({"trial_a": gaits[0].id, "trial_b": gaits[2].id, "answer": "a", "author": "K"});
    let refused = service.post(&format!("/api/v1/studies/{study}/preferences"), &pair).await;
    assert!(refused.text.contains("a walkable gait"), "{}", refused.text);
    let plan = json!({"trial_a": gaits[0].id, "trial_b": gaits[2].id});
    let refused = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &plan).await;
    assert_eq!((refused.status, &refused.json()["field"]), (StatusCode::UNPROCESSABLE_ENTITY, &json!("trial_a")));

    service.post(&format!("{session}/unblind"), &json!({"reason": "a stumble"})).await;
    let row = lab_sessions::of_study(&mut service.store.read().await.unwrap(), study).await.unwrap().remove(0);
    let (_, of_walk_three) = row.walked().unwrap();
    assert_eq!(closed().await, [gaits[0].id == of_walk_three, gaits[1].id == of_walk_three]);
    let assessments = service.fetch(&format!("/api/v1/studies/{study}/assessments")).await.items();
    assert_eq!((&assessments[0]["answer"], &assessments[0]["note"]), (&json!("unsafe_b"), &json!("stumbled")));
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    assert_eq!(page.matches(">unsafe</a> by ").count(), 1, "{page}");
    service.stop().await;
}

#[tokio::test]
async fn lab_session_requires_two_converged_gaits_of_its_study() {
    let (_folder, service, study, trials) = finished().await;
    let gaits = converged(&trials);
    let other = service.study(|new| new.number_of_trials = 1).await;
    service.wait_for(other, &[StudyState::Finished]).await;
    let foreign = service.trials(other).await[0].id;
    let no_gait = trials.iter().find(|trial| trial.state != TrialState::Converged).unwrap().id;
    let path = format!("/api/v1/studies/{study}/lab-sessions");
    for (two, expected) in [
        (foreign, "a trial of this study"),
        (no_gait, "Only a converged gait can be used for walking"),
        (gaits[0].id, "a different gait"),
    ] {
        let refused = service.post(&path, &json!({"trial_a": gaits[0].id, "trial_b": two})).await;
        assert_eq!(refused.json()["field"], "trial_b");
        assert!(refused.text.contains(expected), "{}", refused.text);
    }
    let form = format!("/studies/{study}/lab");
    let refused = service.post_text(&form, FORM, &format!("trial_a={}&trial_b=x&notes=level", gaits[0].id)).await;
    assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert!(
        refused.text.contains("a gait from the list") && refused.text.contains(">level</textarea>"),
        "{}",
        refused.text
    );
    assert_eq!(service.fetch(&path).await.items(), json!([]));

    let body = format!("trial_a={}&trial_b={}&notes=", gaits[0].id, gaits[1].id);
    let made = service.post_text(&form, FORM, &body).await;
    let page = made.headers["location"].to_str().unwrap().to_owned();
    let shown = service.fetch(&page).await.text;
    assert!(shown.contains("one of the two gaits (blinded)") && shown.contains("without the device"), "{shown}");
    let lab = page.replace("lab-sessions", "lab");
    for tick in ["", "&complete=", "&complete=no"] {
        let unticked = service.post_text(&lab, FORM, &format!("walk=1&note=left+foot{tick}")).await;
        assert_eq!(unticked.status, StatusCode::CONFLICT);
        assert!(unticked.text.contains("Walk 1 was not recorded") && unticked.text.contains("left foot</textarea>"));
    }
    assert_eq!(service.post_text(&lab, FORM, "walk=1&note=&complete=yes").await.status, StatusCode::SEE_OTHER);
    assert!(service.fetch(&lab).await.text.contains("Walk 2"));
    assert_eq!(service.post_text(&format!("{page}/close"), FORM, "note=").await.status, StatusCode::SEE_OTHER);
    let again = service.post_text(&format!("{page}/close"), FORM, "note=").await;
    assert!(again.status == StatusCode::CONFLICT && again.text.contains("The session is closed"), "{}", again.text);
    assert_eq!(service.post_text(&format!("{page}/unblind"), FORM, "note=over").await.status, StatusCode::SEE_OTHER);
    assert!(!service.fetch(&page).await.text.contains("one of the two gaits (blinded)"));
    service.stop().await;
}

#[tokio::test]
async fn lab_session_form_offers_each_motion_once_and_no_unsafe_gait() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service
        .study(|new| {
            new.search_space = Some(inactive_bound().into());
            new.number_of_trials = 3;
        })
        .await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let offered = async || {
        let page = service.fetch(&format!("/studies/{study}/lab")).await.text;
        let list =
            page.split("id=\"trial_b\"").nth(1).unwrap_or_default().split("</select>").next().unwrap().to_owned();
        trials.iter().filter(|trial| list.contains(&trial.id.to_string())).cloned().collect::<Vec<_>>()
    };
    let both = offered().await;
    assert!(both.len() == 2 && converged(&trials).len() == 3 && !is_same_gait(&both[0], &both[1]), "{both:?}");
    let path = format!("/api/v1/trials/{}/safety-reports", both[0].id);
    assert_eq!(service.post(&path, &json!({"note": "stumbled"})).await.status, StatusCode::CREATED);
    assert_eq!(offered().await, [], "one gait is not enough for a session");
    service.stop().await;
}

#[tokio::test]
async fn archive_preserves_the_lab_sessions_of_its_study() {
    let (folder, service, study, trials) = finished_by(Consistent::default()).await;
    let session = planned(&service, study, &trials).await;
    service.post(&format!("/api/v1/lab-sessions/{}/walks", id(&session)), &json!({"walk": 1})).await;
    for walk in 2..=3 {
        service.post(&format!("/api/v1/lab-sessions/{}/walks", id(&session)), &json!({"walk": walk})).await;
    }
    for (number, answer) in [(1, "first"), (2, "unsafe_first")] {
        let said = json!({"number": number, "answer": answer});
        service.post(&format!("/api/v1/lab-sessions/{}/answers", id(&session)), &said).await;
        service.post(&format!("/api/v1/lab-sessions/{}/retract-answer", id(&session)), &json!({})).await;
    }
    let api = format!("/api/v1/lab-sessions/{}", id(&session));
    service.post(&format!("{api}/measurement-files/emg"), &with_heel(1, &electromyogram(1.0))).await;
    let emg = service.post(&format!("{api}/emg-results"), &json!({})).await.json();
    service.post(&format!("{api}/unblind"), &json!({"reason": "all were walked"})).await;
    let file = exported(&service.store, study).await;
    let before = lab_sessions::of_study(&mut service.store.read().await.unwrap(), study).await.unwrap();
    service.stop().await;
    let other = Store::open(&folder.path().join("b.db")).await.unwrap();
    import(&other, &file).await.unwrap();
    assert_eq!(lab_sessions::of_study(&mut other.read().await.unwrap(), study).await.unwrap(), before);
    assert_eq!(before[0].answers.iter().map(|answer| answer.retracted).collect::<Vec<_>>(), [true, false]);
    // The files in the archive give the same curves.
    let mut computing = other.clone();
    let anew = lab::compute(&mut computing, before[0].id, EmgSettings::default()).await.unwrap();
    assert_eq!(serde_json::to_value(&anew).unwrap(), emg["result"]);
    assert_eq!(lab::emg(&mut computing, before[0].id).await.unwrap().unwrap().result, anew);
    for change in [
        "update lab_allocations set gait_a_first = 1 - gait_a_first",
        "delete from lab_session_steps",
        "delete from measurement_files",
    ] {
        let mut writer = other.write().await.unwrap();
        let refused = sqlx::query(change).execute(&mut **writer).await.unwrap_err().to_string();
        assert!(refused.contains("append-only"), "{refused}");
    }
    other.close().await;
}

/// Tolerance for the rounding of the file to six decimals.
const ROUNDED: f64 = 1e-5;

fn with_heel(walk: u8, recording: &str) -> Value {
    json!({"walk": walk, "recording": recording, "reading": {"heel_strike_column": "heel"}})
}

#[tokio::test]
async fn emg_recordings_are_compared_with_normal_walking_and_can_be_reprocessed() {
    let (_folder, service, study, trials) = finished().await;
    let session = planned(&service, study, &trials).await;
    let api = format!("/api/v1/lab-sessions/{}", id(&session));
    let bring = format!("{api}/measurement-files/emg");
    let early = service.post(&bring, &with_heel(1, &electromyogram(1.0))).await;
    assert!(
        early.status == StatusCode::CONFLICT && early.text.contains("Walk 1 is not recorded yet"),
        "{}",
        early.text
    );
    for walk in 1..=3 {
        service.post(&format!("/api/v1/lab-sessions/{}/walks", id(&session)), &json!({"walk": walk})).await;
    }
    let missing = service.fetch(&format!("{api}/emg-results")).await;
    assert_eq!(missing.status, StatusCode::NOT_FOUND);
    assert!(missing.json()["detail"].as_str().unwrap().starts_with("There is no EMG result for lab session "));
    assert_eq!(service.post(&format!("{api}/emg-results"), &json!({})).await.status, StatusCode::CONFLICT);
    for (walk, strength) in [(1, 9.0), (2, 1.5), (1, 1.0)] {
        let kept = service.post(&bring, &with_heel(walk, &electromyogram(strength))).await;
        assert_eq!(kept.status, StatusCode::CREATED, "{}", kept.text);
    }
    let same = service.post(&bring, &with_heel(3, &electromyogram(1.5))).await;
    assert!(same.status == StatusCode::CONFLICT && same.text.contains("already uploaded for walk 2"), "{}", same.text);
    let done = service.post(&format!("{api}/emg-results"), &json!({})).await;
    assert_eq!(done.status, StatusCode::CREATED, "{}", done.text);
    let walks = done.json()["result"]["walks"].as_array().unwrap().clone();
    let used: Vec<_> = walks.iter().map(|walk| walk["walk"].clone()).collect();
    assert_eq!(used, [json!(1), json!(2)], "the newest recording of each walk");
    let peak = |walk: &Value, channel: usize| {
        let mean = walk["channels"][channel]["mean"].as_array().unwrap();
        mean.iter().map(|value| value.as_f64().unwrap()).fold(0.0, f64::max)
    };
    assert!((peak(&walks[0], 1) - 1.0).abs() < 1e-12 && (peak(&walks[1], 1) - 1.5).abs() < ROUNDED);
    assert_eq!(walks[0]["channels"][0]["strides"], 5);
    // One channel is 1.5 times as strong, the others are the same: 0.5 times the RMS of its normal curve.
    let normal = walks[0]["channels"][1]["mean"].as_array().unwrap();
    let squares: f64 = normal.iter().map(|value| value.as_f64().unwrap().powi(2)).sum();
    let by_hand = 0.5 * (squares / 101.0).sqrt();
    let total = walks[1]["emg_rmse"]["total"].as_f64().unwrap();
    assert!((total - by_hand).abs() < ROUNDED && walks[0]["emg_rmse"].is_null(), "{total} {by_hand}");
    assert!((walks[1]["emg_rmse"]["parts"][1].as_f64().unwrap() - by_hand).abs() < ROUNDED);
    let average = |walk: usize| walks[walk]["averages"][1].as_f64().unwrap();
    assert!((average(1) - 1.5 * average(0)).abs() < ROUNDED);

    let other = json!({"settings": {"envelope_hz": 3.0, "order": 2}});
    let anew = service.post(&format!("{api}/emg-results"), &other).await.json();
    assert_eq!(
        anew["result"]["settings"],
        json!({"band_low_hz": 20.0, "band_high_hz": 450.0, "envelope_hz": 3.0, "order": 2})
    );
    assert_ne!(anew["result"]["walks"][0]["averages"], walks[0]["averages"]);
    assert_eq!(service.fetch(&format!("{api}/emg-results")).await.json(), anew);
    let refused = service.post(&format!("{api}/emg-results"), &json!({"settings": {"band_high_hz": 500.0}})).await;
    assert_eq!(
        (refused.status, &refused.json()["field"]),
        (StatusCode::UNPROCESSABLE_ENTITY, &json!("settings.band_high_hz"))
    );
    let page = service.fetch(&format!("/lab-sessions/{}", id(&session))).await.text;
    assert!(page.contains("EMG, left tibialis anterior") && page.contains("low-pass 3 Hz, order 2"), "{page}");
    assert!(page.contains("Means of 5 strides (without the device), 5 strides (walk 2)"), "{page}");
    assert!(page.contains(">EMG RMSE</th>") && page.contains(">walk 2</th>"), "{page}");
    service.stop().await;
}

#[tokio::test]
async fn measurement_file_is_downloaded_unchanged() {
    let (_folder, service, study, trials) = finished().await;
    let session = planned(&service, study, &trials).await;
    let api = format!("/api/v1/lab-sessions/{}", id(&session));
    service.post(&format!("/api/v1/lab-sessions/{}/walks", id(&session)), &json!({"walk": 1})).await;
    // The stored file keeps what the parser ignores: comments, line ends and trailing blank lines.
    let file = format!("# Größe 1,8 m\r\n{}\r\n\r\n", electromyogram(1.0).trim_end().replace('\n', "\r\n"));
    let kept = service.post(&format!("{api}/measurement-files/emg"), &with_heel(1, &file)).await;
    assert_eq!(kept.status, StatusCode::CREATED, "{}", kept.text);
    let kept = kept.json();
    let path = format!("/api/v1/measurement-files/{}/content", id(&kept));
    let answer = service.fetch(&path).await;
    assert_eq!((answer.status, answer.text.as_bytes()), (StatusCode::OK, file.as_bytes()));
    assert_eq!(answer.headers["etag"], format!("\"{}\"", kept["raw_sha256"].as_str().unwrap()));
    assert_eq!(answer.content_type(), "text/csv; charset=utf-8");
    let name = answer.headers["content-disposition"].to_str().unwrap();
    assert!(name.starts_with("attachment; filename=\"walk-1-emg-"), "{name}");
    assert!(service.fetch(&format!("/lab-sessions/{}", id(&session))).await.text.contains(&format!("href=\"{path}\"")));
    let unknown = service.fetch(&format!("/api/v1/measurement-files/{study}/content")).await;
    assert_eq!(unknown.status, StatusCode::NOT_FOUND, "{}", unknown.text);
    service.stop().await;
}

#[tokio::test]
async fn incomplete_file_is_refused_with_its_line_and_changes_nothing() {
    let (_folder, service, study, trials) = finished().await;
    let session = planned(&service, study, &trials).await;
    let api = format!("/api/v1/lab-sessions/{}", id(&session));
    service.post(&format!("/api/v1/lab-sessions/{}/walks", id(&session)), &json!({"walk": 1})).await;
    let whole = electromyogram(1.0);
    let half = &whole[..whole.find("\n1.5,").unwrap() + 9];
    for (body, expected) in [
        (with_heel(1, half), "recording, line 1502"),
        (with_heel(1, &whole.replace("\n1.5,", "\n1.5,x")), "recording, line 1502, column 2"),
        (with_heel(1, &whole.replace("TA_L", "TA")), "column \\\"TA_L\\\" (left tibialis anterior) is missing"),
        (with_heel(4, &whole), "1, 2 or 3"),
        (json!({"walk": 1, "recording": whole}), "at least two heel-strike times, or none if a heel strike column"),
        (
            json!({"walk": 1, "recording": whole, "reading": {"heel_strikes_s": [0.1, 0.2]}}),
            "no stride within the recording lasts",
        ),
        (json!({"walk": 1, "recording": whole, "reading": {"heel_strikes_s": [0.1, 99.0]}}), "heel_strikes_s is 99"),
        (json!({"walk": 1, "recording": whole, "reading": {"channels": {"XX": "TA_L"}}}), "RF_L, TA_L, BF_L"),
        (json!({"walk": 1, "recording": whole, "reading": {"format": "opensim"}}), "endheader"),
        (json!({"walk": 1, "recording": whole, "reading": {"format": "c3d"}}), "format"),
    ] {
        let refused = service.post(&format!("{api}/measurement-files/emg"), &body).await;
        assert!(refused.status.is_client_error(), "{expected}: {}", refused.text);
        assert!(refused.text.contains(expected), "{expected}: {}", refused.text);
    }
    for (change, expected) in [
        (json!({"recording": joint_angles().replace("\n5,", "\n5,x")}), "recording, line 502, column 2"),
        (json!({"recording": "time_s,knee\n0,1"}), "recording"),
        (json!({"reading": {"cutoff_hz": 90.0}}), "reading.cutoff_hz"),
        (json!({"walk": 2}), "Walk 2 is not recorded yet"),
    ] {
        let mut body = json!({"walk": 1, "recording": joint_angles()});
        body.as_object_mut().unwrap().extend(change.as_object().unwrap().clone());
        let refused = service.post(&format!("{api}/measurement-files/joint-angles"), &body).await;
        assert!(refused.status.is_client_error() && refused.text.contains(expected), "{expected}: {}", refused.text);
    }
    let page = format!("/lab-sessions/{}", id(&session));
    let form = "walk=1&format=csv&recording=time_s%2CTA_L&heel_strike_column=heel&channels=TA";
    let refused = service.post_text(&format!("{page}/measurement-files/emg"), FORM, form).await;
    assert!(refused.text.contains("CHANNEL=COLUMN"), "{}", refused.text);
    for typed in ["<details open>", ">time_s,TA_L</textarea>", "value=\"heel\"", "value=\"TA\""] {
        assert!(refused.text.contains(typed), "{typed} comes back: {}", refused.text);
    }
    for (kind, form, expected) in [
        (
            "emg",
            "walk=1&format=opensim&recording=x&rate_hz=1000",
            "\u{201c}Sampling rate, Hz\u{201d} is 1000; it must be omitted",
        ),
        (
            "emg",
            "walk=1&format=csv&recording=x&rate_hz=fast",
            "\u{201c}Sampling rate, Hz\u{201d} is \u{201c}fast\u{201d}; it must be a number",
        ),
        (
            "joint-angles",
            "walk=1&format=csv&recording=x&cutoff_hz=fast",
            "\u{201c}Low-pass cut-off, Hz\u{201d} is \u{201c}fast\u{201d}",
        ),
    ] {
        let refused = service.post_text(&format!("{page}/measurement-files/{kind}"), FORM, form).await;
        assert!(refused.text.contains(expected), "{expected}: {}", refused.text);
    }
    assert_eq!(service.fetch(&format!("{api}/measurement-files")).await.items(), json!([]), "nothing was kept");
    service.post(&format!("{api}/close"), &json!({})).await;
    let closed = service.post(&format!("{api}/measurement-files/emg"), &with_heel(1, &whole)).await;
    assert!(closed.status == StatusCode::CONFLICT && closed.text.contains("The session is closed"), "{}", closed.text);
    service.stop().await;
}

#[tokio::test]
async fn forms_of_a_session_report_every_refused_field() {
    let (_folder, service, study, trials) = finished().await;
    let session = planned(&service, study, &trials).await;
    service.post(&format!("/api/v1/lab-sessions/{}/walks", id(&session)), &json!({"walk": 1})).await;
    let page = format!("/lab-sessions/{}", id(&session));
    let file = electromyogram(1.0).replace("RF_L", "EMG 1").replace("TA_L", "EMG 2");
    let typed = "heel_strikes_s=1,+x&heel_strike_column=nope&heel_strike_threshold=abc&rejected_strides=two&rate_hz=5";
    for button in ["upload", "preview"] {
        let form = format!("walk=1&format=csv&recording={file}&button={button}&{typed}");
        let refused = service.post_text(&format!("{page}/measurement-files/emg"), FORM, &form).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", refused.text);
        for says in [
            "\u{201c}Right heel strikes, s\u{201d} is \u{201c} x\u{201d}; it must be a number",
            "\u{201c}Contact threshold\u{201d} is \u{201c}abc\u{201d}",
            "\u{201c}Rejected strides\u{201d} is \u{201c}two\u{201d}",
            "\u{201c}Sampling rate, Hz\u{201d} is 5; it must be 100 to 20",
            "value=\"nope\"",
        ] {
            assert!(refused.text.contains(says), "{button}: {says}: {}", refused.text);
        }
        if button == "upload" {
            let columns =
                "Muscles: columns &#34;RF_L&#34; (left rectus femoris) and &#34;TA_L&#34; (left tibialis anterior)";
            assert!(refused.text.contains(columns), "{}", refused.text);
            assert!(refused.text.contains("Heel strike column: column &#34;nope&#34; is missing"), "{}", refused.text);
        }
    }
    let kept = service.post(&format!("/api/v1{page}/measurement-files/emg"), &with_heel(1, &electromyogram(1.0))).await;
    assert_eq!(kept.status, StatusCode::CREATED, "{}", kept.text);
    let all = "band_low_hz=a&band_high_hz=5000&envelope_hz=c&order=3";
    let refused = service.post_text(&format!("{page}/process"), FORM, all).await;
    for says in [
        "4 fields need correcting",
        "\u{201c}Band-pass from, Hz\u{201d} is \u{201c}a\u{201d}",
        "\u{201c}Band-pass to, Hz\u{201d} is 5000",
        "\u{201c}Low-pass cut-off, Hz\u{201d} is \u{201c}c\u{201d}",
        "\u{201c}Filter order\u{201d} is",
        "value=\"5000\" aria-invalid",
    ] {
        assert!(refused.text.contains(says), "{says}: {}", refused.text);
    }
    service.stop().await;
}

#[tokio::test]
async fn plan_offers_the_recommended_gait_first_or_names_gaits_to_certify() {
    let (_folder, service, study, _) = finished().await;
    let shown = service.fetch(&format!("/studies/{study}/lab")).await.text;
    let first = shown.split_once("<option ").unwrap().1.split_once("</option>").unwrap().0;
    assert!(first.contains("(recommended, Gait RMSE "), "{first}");
    service.stop().await;

    let folder = tempfile::tempdir().unwrap();
    let service = Service::start_without_certificates(&folder.path().join("a.db"), Analytic::default()).await;
    let study = service.study(|new| new.number_of_trials = 8).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let shown = service.fetch(&format!("/studies/{study}/lab")).await.text;
    assert!(shown.contains("This study has none so far") && !shown.contains("<option"), "{shown}");
    assert!(shown.contains("/certify\"") && shown.contains(">Certify trial "), "{shown}");
    service.stop().await;
}

#[tokio::test]
async fn answered_session_asks_for_no_more_walks() {
    let (_folder, service, study, trials) = finished().await;
    let session = planned(&service, study, &trials).await;
    let (api, page) = (format!("/api/v1/lab-sessions/{}", id(&session)), format!("/lab-sessions/{}", id(&session)));
    for walk in 1..=3 {
        service.post(&format!("{api}/walks"), &json!({"walk": walk})).await;
    }
    assert!(service.fetch(&page).await.text.contains("page for the tablet"));
    let number = service.fetch(&format!("{api}/next-walk")).await.json()["answer_number"].clone();
    let answered = service.post(&format!("{api}/answers"), &json!({"answer": "first", "number": number})).await;
    assert!(answered.status.is_success(), "{}", answered.text);
    assert_eq!(service.fetch(&api).await.json()["state"], "answered");
    service.post(&format!("{api}/unblind"), &json!({"reason": "all were walked"})).await;
    let shown = service.fetch(&page).await.text;
    assert!(shown.contains("answered, unblinded</span>") && !shown.contains("page for the tablet"), "{shown}");
    service.stop().await;
}

#[tokio::test]
async fn limit_cycles_are_drawn_over_the_gait_after_unblinding() {
    let (_folder, service, study, trials) = finished().await;
    let session = planned(&service, study, &trials).await;
    let (api, page) = (format!("/api/v1/lab-sessions/{}", id(&session)), format!("/lab-sessions/{}", id(&session)));
    for walk in 1..=2 {
        service.post(&format!("/api/v1/lab-sessions/{}/walks", id(&session)), &json!({"walk": walk})).await;
    }
    let recording = joint_angles().replace('\n', "%0A").replace(',', "%2C");
    for walk in 1..=2 {
        let form = format!("walk={walk}&format=csv&unit=&cutoff_hz=6&recording=%23 walk {walk}%0A{recording}");
        let kept = service.post_text(&format!("{page}/measurement-files/joint-angles"), FORM, &form).await;
        assert_eq!(kept.status, StatusCode::SEE_OTHER, "{}", kept.text);
    }
    let cycles = service.fetch(&format!("{api}/limit-cycles")).await.items();
    let joints: Vec<_> = cycles[1]["joints"].as_array().unwrap().iter().map(|joint| &joint["joint"]).collect();
    assert_eq!((joints, &cycles[1]["cutoff_hz"]), (vec![&json!("knee_R"), &json!("ankle_R")], &json!(6.0)));
    let before = service.fetch(&page).await.text;
    assert!(before.contains("Right knee, walk 2") && !before.contains("limit cycle of the gait"), "{before}");
    service.post(&format!("{api}/unblind"), &json!({"reason": "all were walked"})).await;
    let after = service.fetch(&page).await.text;
    assert!(after.contains("limit cycle of the gait") && !after.contains("Right knee, walk 2"), "{after}");
    service.stop().await;
}

#[tokio::test]
async fn joint_angle_preview_shows_strides_and_stores_nothing() {
    let (_folder, service, study, trials) = finished().await;
    let session = planned(&service, study, &trials).await;
    service.post(&format!("/api/v1/lab-sessions/{}/walks", id(&session)), &json!({"walk": 1})).await;
    let page = format!("/lab-sessions/{}/measurement-files/joint-angles", id(&session));
    let mut file = "time_s,torso_rad,hip_R_rad,knee_R_rad\n".to_owned();
    for sample in 0..1200 {
        let phase = std::f64::consts::TAU * f64::from(sample) / 120.0;
        let row = (f64::from(sample) / 100.0, 0.02 * phase.sin(), 0.4 * phase.cos(), 0.3 + 0.2 * phase.sin());
        writeln!(file, "{},{},{},{}", row.0, row.1, row.2, row.3).unwrap();
    }
    let send = async |file: &str| {
        let form = format!("walk=1&format=csv&cutoff_hz=6&file_name=angles.csv&button=preview&recording={file}");
        service.post_text(&page, FORM, &form).await
    };
    let shown = send(&file).await;
    assert_eq!(shown.status, StatusCode::OK, "{}", shown.text);
    assert!(shown.text.contains("The recording can be uploaded: angles.csv."), "{}", shown.text);
    assert_eq!(shown.text.matches("angle, ° over time, s\"").count(), 3, "a chart for each joint");
    assert!(shown.text.contains("right heel strike") && shown.text.contains("<td>plausible</td>"), "{}", shown.text);
    let short: String = file.lines().take(200).fold(String::new(), |text, line| text + line + "\n");
    assert!(send(&short).await.text.contains("Not ready for upload"));
    assert_eq!(send("time_s,hip_R_rad%0A0,x").await.status, StatusCode::UNPROCESSABLE_ENTITY);
    let files = service.fetch(&format!("/api/v1/lab-sessions/{}/measurement-files", id(&session))).await.items();
    assert_eq!(files, json!([]));
    service.stop().await;
}

#[tokio::test]
async fn emg_preview_shows_strides_and_stores_nothing_and_rejected_strides_are_left_out() {
    let (_folder, service, study, trials) = finished().await;
    let session = planned(&service, study, &trials).await;
    service.post(&format!("/api/v1/lab-sessions/{}/walks", id(&session)), &json!({"walk": 1})).await;
    let page = format!("/lab-sessions/{}/measurement-files/emg", id(&session));
    let file = electromyogram(1.0).replace("RF_L", "EMG 1");
    let send = async |rest: &str| {
        service
            .post_text(&page, FORM, &format!("walk=1&format=csv&recording={file}&heel_strike_threshold=0.5&{rest}"))
            .await
    };
    let files =
        async || service.fetch(&format!("/api/v1/lab-sessions/{}/measurement-files", id(&session))).await.items();

    let columns =
        "column_RF_L=EMG+1&column_TA_L=TA_L&column_BF_L=BF_L&column_GAS_L=GAS_L&column_RF_R=RF_R&column_BF_R=BF_R";
    let first = send("button=preview").await;
    assert_eq!(first.status, StatusCode::OK, "{}", first.text);
    assert!(
        first.text.contains("Not ready for upload") && first.text.contains("<option>EMG 1</option>"),
        "{}",
        first.text
    );
    assert!(first.text.contains("(left rectus femoris)") && first.text.contains("at least two heel-strike times"));
    let shown =
        send(&format!("button=preview&heel_strike_column=heel&rejected_strides=2&{columns}&file_name=walk1.csv")).await;
    assert!(shown.text.contains("The recording can be uploaded: walk1.csv."), "{}", shown.text);
    assert_eq!(shown.text.matches("raw signal over time, s\"").count(), 6, "a chart for each channel");
    assert!(shown.text.contains("<option selected>EMG 1</option>") && shown.text.contains("<td>rejected</td>"));
    assert_eq!(files().await, json!([]), "a preview stores nothing");
    let unreadable = service.post_text(&page, FORM, "walk=1&format=csv&recording=time_s,a%0A0,x&button=preview").await;
    assert_eq!(unreadable.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", unreadable.text);

    let beyond = send(&format!("button=upload&heel_strike_column=heel&rejected_strides=9&{columns}")).await;
    assert!(
        beyond.status == StatusCode::UNPROCESSABLE_ENTITY && beyond.text.contains("Rejected strides"),
        "{}",
        beyond.text
    );
    let kept =
        send(&format!("button=upload&heel_strike_column=heel&rejected_strides=2&{columns}&file_name=walk1.csv")).await;
    assert_eq!(kept.status, StatusCode::SEE_OTHER, "{}", kept.text);
    assert_eq!(files().await[0]["file_name"], "walk1.csv");
    service.post(&format!("/api/v1/lab-sessions/{}/walks", id(&session)), &json!({"walk": 2})).await;
    let next = service.fetch(&format!("/lab-sessions/{}", id(&session))).await.text;
    assert!(next.contains("1 (replaces its file)</option><option value=\"2\" selected>2</option>"), "{next}");
    let result = service.post(&format!("/api/v1/lab-sessions/{}/emg-results", id(&session)), &json!({})).await.json();
    assert_eq!(result["result"]["walks"][0]["channels"][0]["strides"], 4, "{result}");
    assert!(service.fetch(&format!("/lab-sessions/{}", id(&session))).await.text.contains(">walk1.csv</a>"));
    service.stop().await;
}
