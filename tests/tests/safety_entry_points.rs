//! A safety report applies to every trial of the subject with the same motion, from its acknowledgement on, whatever
//! the clock, and from every entry point.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, StatusCode};
use gait_optimizer::Device;
use gaitwright_service::access::{Caller, Right};
use gaitwright_service::studies::lab;
use gaitwright_service::studies::new_safety_report::{self, NewSafetyReport};
use gaitwright_service::studies::study_plan::NewStudy;
use gaitwright_service::studies::walkable::{self, NotWalkable};
use gaitwright_store::studies::{AnswerSource, Evaluation, StudyState};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{DeviceId, StudyId, TokenId, commit};
use gaitwright_tests::callers::FORM;
use gaitwright_tests::scripted;
use gaitwright_tests::service::Service;
use gaitwright_tests::well_formed::WellFormed;
use serde_json::{Value, json};
use std::time::Duration;
use tempfile::TempDir;

async fn service() -> (TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), WellFormed::default(), 1).await;
    (folder, service)
}

async fn finished(service: &Service) -> (StudyId, Vec<Trial>) {
    let study = service.study(|new| new.number_of_trials = 12).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    (study, converged(service, study).await)
}

async fn converged(service: &Service, study: StudyId) -> Vec<Trial> {
    let mut trials = service.trials(study).await;
    trials.retain(|trial| trial.state == TrialState::Converged);
    trials
}

async fn controller(service: &Service, trial: &Trial) -> StatusCode {
    service.fetch(&format!("/api/v1/trials/{}/controller.json", trial.id)).await.status
}

async fn report(service: &Service, trial: &Trial) -> Value {
    let path = format!("/api/v1/trials/{}/safety-reports", trial.id);
    let reported = service.post(&path, &json!({"note": "stumbled"})).await;
    assert_eq!(reported.status, StatusCode::CREATED, "{}", reported.text);
    reported.json()
}

async fn clear(service: &Service, trial: &Trial) -> StatusCode {
    let path = format!("/api/v1/trials/{}/safety-reviews", trial.id);
    service.post(&path, &json!({"decision": "cleared", "reason": "seen again"})).await.status
}

#[tokio::test]
async fn report_covers_every_trial_of_the_subject_with_the_same_motion() {
    let (_folder, service) = service().await;
    let (study, trials) = finished(&service).await;
    // With another limit, the solves do not take the results of the first study.
    let other = service.study(|new| (new.number_of_trials, new.solve_options.max_iterations) = (12, 999)).await;
    service.wait_for(other, &[StudyState::Finished]).await;
    let best = service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await.json()["trial_id"].clone();
    let best = trials.iter().find(|trial| json!(trial.id) == best).unwrap();
    let twin = converged(&service, other).await.into_iter().find(|trial| trial.action == best.action).unwrap();
    let cost = |trial: &Trial| trial.report.as_ref().unwrap().cost_of_transport;
    assert!((cost(&twin) / cost(best) - 1.0).abs() > 1e-5, "solves of one gait differ");
    assert_eq!((controller(&service, best).await, controller(&service, &twin).await), (StatusCode::OK, StatusCode::OK));
    report(&service, &twin).await;
    let refused = service.fetch(&format!("/api/v1/trials/{}/controller.json", best.id)).await;
    assert_eq!(refused.status, StatusCode::CONFLICT);
    assert!(refused.text.contains("another study of this subject"), "{}", refused.text);
    let recommended = service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await.json();
    assert_ne!(recommended["trial_id"], json!(best.id));
    let other = trials.iter().find(|trial| trial.id != best.id).unwrap();
    let plan = json!({"trial_a": best.id, "trial_b": other.id});
    let planned = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &plan).await;
    assert_eq!(planned.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", planned.text);
    let page = service.fetch(&format!("/trials/{}", best.id)).await.text;
    assert!(page.contains("Do not walk with it") && !page.contains("controller.json"), "{page}");
    // The report is reviewed in the study in which it was made.
    let review = json!({"decision": "cleared", "reason": "r"});
    let there = service.post(&format!("/api/v1/trials/{}/safety-reviews", best.id), &review).await;
    assert!(there.status == StatusCode::CONFLICT && there.text.contains("Review the report there"), "{}", there.text);
    assert_eq!(clear(&service, &twin).await, StatusCode::CREATED);
    assert_eq!(controller(&service, best).await, StatusCode::OK);
    service.stop().await;
}

/// Trials of one action: evaluated by a lab script in two studies, by the service in a third one, and by a lab script
/// with another device.
#[tokio::test]
async fn report_covers_every_trial_with_equal_bounds_if_a_lab_script_evaluated_one() {
    let (_folder, service) = service().await;
    let device = another_device(&service).await;
    let by_script = |new: &mut NewStudy| (new.evaluation, new.number_of_trials) = (Evaluation::Script, 3);
    let (first, second) = (service.study(by_script).await, service.study(by_script).await);
    let on_another = service
        .study(|new| {
            by_script(new);
            new.device_id = Some(device);
        })
        .await;
    let computed = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(computed, &[StudyState::Finished]).await;
    let reported = scripted::trial(&service, first).await;
    let mut others = vec![scripted::trial(&service, second).await, scripted::trial(&service, on_another).await];
    others.extend(converged(&service, computed).await.into_iter().filter(|trial| trial.number == 1));
    assert!(others.len() == 3 && others.iter().all(|trial| trial.action == reported.action));
    let different = scripted::trial(&service, second).await;
    assert_ne!(different.action, reported.action);

    let is_closed = async |trial: &Trial| {
        let found = walkable::admit(&mut service.store.read().await.unwrap(), trial.id).await.unwrap();
        matches!(found, Err(NotWalkable::ReportedUnsafe { .. } | NotWalkable::SameGaitReportedUnsafe { .. }))
    };
    assert!(!is_closed(&reported).await && !is_closed(&others[0]).await);
    report(&service, &reported).await;
    assert!(is_closed(&reported).await && is_closed(&others[0]).await);
    assert!(!is_closed(&others[1]).await, "equal bounds give another gait with another device");
    assert!(is_closed(&others[2]).await, "the gait of the lab may be this one");
    assert!(!is_closed(&different).await);
    assert_eq!(clear(&service, &reported).await, StatusCode::CREATED);
    assert!(!is_closed(&others[0]).await && !is_closed(&others[2]).await);

    report(&service, &others[2]).await;
    assert!(is_closed(&reported).await && !is_closed(&others[1]).await);
    service.stop().await;
}

#[tokio::test]
async fn lab_script_does_not_receive_bounds_of_unsafe_gaits() {
    let (_folder, service) = service().await;
    let by_script = |new: &mut NewStudy| (new.evaluation, new.number_of_trials) = (Evaluation::Script, 3);
    let (first, second, third) =
        (service.study(by_script).await, service.study(by_script).await, service.study(by_script).await);
    let ask = async |study: StudyId| service.post(&format!("/api/v1/studies/{study}/ask"), &json!({})).await;
    let open = ask(second).await.json();
    let with_key = || {
        let request = Request::post(format!("/api/v1/studies/{third}/ask")).header("idempotency-key", "morning");
        service.send(request.body(Body::empty()).unwrap())
    };
    assert_eq!(with_key().await.json()["action"], open["action"]);
    let reported = scripted::trial(&service, first).await;
    assert_eq!(open["action"], json!(reported.action));
    report(&service, &reported).await;

    let repeated = with_key().await;
    assert!(repeated.status == StatusCode::CONFLICT && repeated.text.contains("Cancel the trial"), "{}", repeated.text);
    for open in service.trials(third).await {
        service.post(&format!("/api/v1/trials/{}/cancel", open.id), &json!({})).await;
    }

    let again = ask(second).await;
    assert!(again.status == StatusCode::CONFLICT && again.text.contains("Cancel the trial"), "{}", again.text);
    service.post(&format!("/api/v1/trials/{}/cancel", open["id"].as_str().unwrap()), &json!({})).await;
    for study in [first, second, third] {
        let given = ask(study).await;
        assert_eq!(given.status, StatusCode::CREATED, "{}", given.text);
        assert_ne!(given.json()["action"], json!(reported.action));
    }
    service.stop().await;
}

/// A device that differs from the built-in one in its name.
async fn another_device(service: &Service) -> DeviceId {
    let definition = Device { name: "AMPRO3, second unit".to_owned(), ..Device::ampro3().unwrap() };
    let made = service.post("/api/v1/devices", &json!(definition)).await;
    assert_eq!(made.status, StatusCode::CREATED, "{}", made.text);
    made.json()["id"].as_str().unwrap().parse().unwrap()
}

#[tokio::test]
async fn single_gait_is_reported_without_a_comparison() {
    let (_folder, service) = service().await;
    let (study, trials) = finished(&service).await;
    let made = report(&service, &trials[0]).await;
    assert_eq!((&made["trial_id"], &made["in_force"]), (&json!(trials[0].id), &json!(true)));
    assert_eq!(controller(&service, &trials[0]).await, StatusCode::CONFLICT);
    let sent = service.post_text(&format!("/trials/{}/safety-report", trials[1].id), FORM, "author=K1&note=fell").await;
    assert_eq!(sent.status, StatusCode::SEE_OTHER, "{}", sent.text);
    assert_eq!(controller(&service, &trials[1]).await, StatusCode::CONFLICT);
    let listed = service.fetch(&format!("/api/v1/studies/{study}/safety-reports")).await.items();
    assert_eq!(listed.as_array().unwrap().len(), 2);
    // The report does not reach the learner.
    assert!(service.feedback(study).await.iter().all(|row| row.author != "K1"));
    service.stop().await;
}

#[tokio::test]
async fn report_between_walks_ends_the_walks() {
    let (_folder, service) = service().await;
    let (study, trials) = finished(&service).await;
    let gaits = json!({"trial_a": trials[0].id, "trial_b": trials[1].id});
    let session = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &gaits).await.json();
    let lab = format!("/api/v1/lab-sessions/{}", session["id"].as_str().unwrap());
    let unsafe_first = json!({"number": 1, "answer": "unsafe_first"});
    service.post(&format!("{lab}/walks"), &json!({"walk": 1})).await;
    let better = service.post(&format!("{lab}/answers"), &json!({"number": 1, "answer": "first"})).await;
    assert_eq!(better.status, StatusCode::CONFLICT, "only a report is taken before the last walk");
    let page = service.fetch(&format!("/lab/{}", session["id"].as_str().unwrap())).await.text;
    assert!(page.contains("Report a walk as unsafe"), "{page}");
    let reported = service.post(&format!("{lab}/answers"), &unsafe_first).await;
    assert_eq!(reported.status, StatusCode::OK, "{}", reported.text);
    assert_eq!(reported.json()["walk"], Value::Null);
    let page = service.fetch(&format!("/lab/{}", session["id"].as_str().unwrap())).await.text;
    assert!(page.contains("A walk was reported as unsafe") && !page.contains("All walks are recorded"), "{page}");
    assert!(service.fetch("/lab").await.text.contains("a walk was reported as unsafe"));
    for walk in [2, 3] {
        let file = service.fetch(&format!("{lab}/controller.json?walk={walk}")).await;
        assert_eq!(file.status, StatusCode::CONFLICT, "{}", file.text);
        let recorded = service.post(&format!("{lab}/walks"), &json!({"walk": walk})).await;
        assert_eq!(recorded.status, StatusCode::CONFLICT, "{}", recorded.text);
    }
    for trial in &trials[..2] {
        assert_eq!(controller(&service, trial).await, StatusCode::CONFLICT, "either gait may be meant");
    }
    service.stop().await;
}

#[tokio::test]
async fn controller_file_is_refused_after_a_report_or_the_end_of_the_session() {
    let (_folder, service) = service().await;
    let (study, trials) = finished(&service).await;
    let device = Caller::token(TokenId::fresh(), "rig", &[Right::Device]);
    for ends in ["closed", "reported"] {
        let gaits = json!({"trial_a": trials[0].id, "trial_b": trials[1].id});
        let session = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &gaits).await.json();
        let id = session["id"].as_str().unwrap();
        // As at the end of a request that computed its files before.
        if ends == "closed" {
            service.post(&format!("/api/v1/lab-sessions/{id}/close"), &json!({})).await;
        } else {
            report(&service, &trials[1]).await;
        }
        let mut writer = service.store.write().await.unwrap();
        let refused = lab::for_device(&mut writer, &device, id.parse().unwrap(), 2).await;
        assert!(refused.is_err(), "{ends}");
    }
    service.stop().await;
}

#[tokio::test]
async fn report_stops_a_controller_file_that_waits_for_the_access_log() {
    let (_folder, service) = service().await;
    let (study, trials) = finished(&service).await;
    let gaits = json!({"trial_a": trials[0].id, "trial_b": trials[1].id});
    let session = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &gaits).await.json();
    let of_trial = format!("/api/v1/trials/{}/controller.json", trials[0].id);
    let of_walk = format!("/api/v1/lab-sessions/{}/controller.json?walk=2", session["id"].as_str().unwrap());
    for path in [of_trial, of_walk] {
        let mut writer = service.store.write().await.unwrap();
        let report = async {
            // Long enough for the file to be made; the response then waits for the writer.
            tokio::time::sleep(Duration::from_secs(2)).await;
            let report: NewSafetyReport = serde_json::from_value(json!({"note": "stumbled"})).unwrap();
            new_safety_report::give(&mut writer, &Caller::without_sign_in(), trials[0].id, &report).await.unwrap();
            commit(writer).await.unwrap();
        };
        let (refused, ()) = tokio::join!(service.fetch(&path), report);
        assert_eq!(refused.status, StatusCode::CONFLICT, "{path}");
        assert_eq!(clear(&service, &trials[0]).await, StatusCode::CREATED);
    }
    service.stop().await;
}

#[tokio::test]
async fn pair_is_no_longer_shown_to_its_rater_after_a_report() {
    let (_folder, service) = service().await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (6, AnswerSource::People)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let pair = service.post(&format!("/api/v1/studies/{study}/blind-pairs/next"), &json!({})).await.json();
    let code = pair["pair"]["code"].as_str().unwrap();
    let motion = format!("/api/v1/blind-pairs/{code}/motions/first");
    assert_eq!(service.fetch(&motion).await.status, StatusCode::OK);
    for trial in converged(&service, study).await {
        report(&service, &trial).await;
    }
    assert_eq!(service.fetch(&motion).await.status, StatusCode::CONFLICT);
    assert_eq!(service.fetch(&format!("/rate/pair/{code}")).await.status, StatusCode::CONFLICT);
    service.stop().await;
}

#[tokio::test]
async fn safety_report_of_an_assessment_is_reviewed_and_cannot_be_retracted() {
    let (_folder, service) = service().await;
    let (study, trials) = finished(&service).await;
    let body = json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "unsafe_a", "author": "K"});
    let made = service.post(&format!("/api/v1/studies/{study}/assessments"), &body).await.json();
    let retract = format!("/api/v1/assessments/{}/retract", made["id"].as_str().unwrap());
    let refused = service.post(&retract, &json!({"reason": "a slip"})).await;
    assert_eq!(refused.status, StatusCode::CONFLICT, "{}", refused.text);
    assert_eq!(controller(&service, &trials[0]).await, StatusCode::CONFLICT);
    assert_eq!(clear(&service, &trials[0]).await, StatusCode::CREATED);
    assert_eq!(controller(&service, &trials[0]).await, StatusCode::OK);
    service.stop().await;
}
