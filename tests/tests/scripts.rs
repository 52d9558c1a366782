//! Ask and tell, and the life of a study, through the REST interface.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Method, Request, StatusCode, header};
use gait_learner::Partner;
use gaitwright_store::StudyId;
use gaitwright_store::feedback::FeedbackContent;
use gaitwright_store::studies::{AnswerSource, Evaluation, StudyState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::described::audit_trail;
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use skipped_tests::skipped_unless_required;
use std::collections::HashMap;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

async fn service() -> (TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 2).await;
    (folder, service)
}

async fn script_study(service: &Service, trials: u32, parallel: u32) -> StudyId {
    service
        .study(|new| {
            (new.evaluation, new.number_of_trials, new.parallel_trials) = (Evaluation::Script, trials, parallel);
        })
        .await
}

/// The loop of a lab script: ask, measure, tell.
async fn run(service: &Service, study: StudyId, script: &str, trials: usize) -> Vec<(u64, f64)> {
    let mut done = Vec::new();
    for _ in 0..trials {
        let asked = service.post(&format!("/api/v1/studies/{study}/ask"), &json!({ "script": script })).await;
        assert_eq!(asked.status, StatusCode::CREATED, "{}", asked.text);
        let trial = asked.json();
        assert_eq!(asked.headers["location"], format!("/api/v1/trials/{}", trial["id"].as_str().unwrap()));
        let rmse = 0.1 + (trial["action"]["a5"].as_f64().unwrap() - 0.026).abs();
        let told = json!({"label": "converged", "gait_rmse_rad": rmse});
        let told = service.post(&format!("/api/v1/trials/{}/tell", trial["id"].as_str().unwrap()), &told).await;
        assert_eq!(told.status, StatusCode::OK, "{}", told.text);
        assert_eq!(told.json()["state"], "converged");
        done.push((trial["action_index"].as_u64().unwrap(), rmse));
    }
    done
}

#[tokio::test]
async fn lab_script_finishes_a_study_and_two_runs_give_the_same_trials() {
    let (_folder, service) = service().await;
    let first = script_study(&service, 8, 1).await;
    let done = run(&service, first, "rig", 8).await;
    let finished = service.wait_for(first, &[StudyState::Finished]).await;
    assert!(finished.state_reason.contains("All 8 trials"));
    let feedback = service.feedback(first).await;
    assert_eq!(feedback.iter().filter(|row| row.source.as_str() == "evaluation").count(), 8);
    assert_eq!(feedback.iter().filter(|row| row.source.as_str() == "gait_rmse").count(), 7);

    let second = script_study(&service, 8, 1).await;
    assert_eq!(run(&service, second, "rig", 8).await, done, "the same seed and results give the same suggestions");
    let late = service.post(&format!("/api/v1/studies/{second}/ask"), &json!({})).await;
    assert_eq!(late.status, StatusCode::CONFLICT, "{}", late.text);
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_octave_script_runs_a_study_to_its_end_as_often_as_it_is_started() {
    let (_folder, service) = service().await;
    if Command::new("curl").arg("--version").output().is_err() {
        return skipped_unless_required("GAITWRIGHT_REQUIRE_OCTAVE", "there is no curl");
    }
    let command = format!("ask_tell('http://{}')", service.listening().await);
    for _ in 0..2 {
        let command = command.clone();
        #[allow(clippy::disallowed_methods)] // a test waits for a process or a thread
        let ran = tokio::task::spawn_blocking(move || {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../server/clients/matlab");
            Command::new("octave-cli").args(["--no-init-file", "--eval", &command]).current_dir(folder).output()
        });
        let Ok(output) = ran.await.unwrap() else {
            return skipped_unless_required("GAITWRIGHT_REQUIRE_OCTAVE", "there is no octave-cli");
        };
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(text.lines().filter(|line| line.starts_with("trial ")).count(), 10, "{text}");
        assert!(text.lines().last().unwrap().starts_with("best: trial "), "{text}");
    }
    service.stop().await;
}

#[tokio::test]
async fn proposal_stays_with_its_worker() {
    let (_folder, service) = service().await;
    let study = script_study(&service, 10, 2).await;
    let ask = format!("/api/v1/studies/{study}/ask");
    let of = |script: &str| json!({ "script": script });
    let left = service.post(&ask, &of("left")).await.json();
    let again = service.post(&ask, &of("left")).await;
    assert_eq!((again.status, again.json()), (StatusCode::OK, left.clone()));
    let right = service.post(&ask, &of("right")).await.json();
    assert_ne!(right["id"], left["id"]);
    assert_ne!(right["action_index"], left["action_index"]);
    let third = service.post(&ask, &of("third")).await;
    assert_eq!(third.status, StatusCode::CONFLICT, "{}", third.text);

    let tell = format!("/api/v1/trials/{}/tell", left["id"].as_str().unwrap());
    for (body, field) in [
        (json!({"label": "not_converged"}), "reason"),
        (json!({"label": "converged"}), "gait_rmse_rad"),
        (json!({"label": "converged", "gait_rmse_rad": -1}), "gait_rmse_rad"),
    ] {
        let refused = service.post(&tell, &body).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", refused.text);
        assert_eq!(refused.json()["field"], field);
    }
    let told = json!({"label": "not_converged", "reason": "the foot scuffed"});
    let told = service.post(&tell, &told).await.json();
    assert_eq!((&told["state"], &told["message"]), (&json!("not_converged"), &json!("the foot scuffed")));
    assert_eq!(
        service.post(&tell, &json!({"label": "not_converged", "reason": "x"})).await.status,
        StatusCode::CONFLICT
    );
    assert_ne!(service.post(&ask, &of("left")).await.json()["id"], left["id"]);

    // A failed evaluation is cancelled rather than reported, and does not reach the learner.
    let cancel = format!("/api/v1/trials/{}/cancel", right["id"].as_str().unwrap());
    assert_eq!(service.post(&cancel, &json!({})).await.json()["state"], "cancelled");
    assert_eq!(service.feedback(study).await.len(), 1);

    let own = service.study(|new| (new.number_of_trials, new.start) = (2, false)).await;
    assert_eq!(service.post(&format!("/api/v1/studies/{own}/ask"), &json!({})).await.status, StatusCode::CONFLICT);
    let details = audit_trail(&service).await;
    assert!(["again"].iter().all(|name| details.contains(*name)), "{details:?}");
    service.stop().await;
}

async fn send(service: &Service, method: Method, path: &str, tag: Option<&str>, body: &Value) -> Answer {
    let mut request = Request::builder().method(method).uri(path).header(header::CONTENT_TYPE, "application/json");
    if let Some(tag) = tag {
        request = request.header(header::IF_MATCH, tag);
    }
    service.send(request.body(Body::from(body.to_string())).unwrap()).await
}

#[tokio::test]
async fn change_based_on_an_old_revision_is_refused() {
    let (_folder, service) = service().await;
    let study = service.study(|new| (new.number_of_trials, new.start) = (3, false)).await;
    let path = format!("/api/v1/studies/{study}");
    let tag = service.fetch(&path).await.headers["etag"].to_str().unwrap().to_owned();
    let changed = send(&service, Method::PATCH, &path, Some(&tag), &json!({"priority": 3})).await;
    assert_eq!((changed.status, &changed.json()["priority"]), (StatusCode::OK, &json!(3)));
    let newer = changed.headers["etag"].to_str().unwrap().to_owned();
    assert_ne!(newer, tag);
    let stale = send(&service, Method::PATCH, &path, Some(&tag), &json!({"priority": 4})).await;
    assert_eq!((stale.status, &stale.json()["type"]), (StatusCode::PRECONDITION_FAILED, &json!("/problems/changed")));
    let stale = send(&service, Method::POST, &format!("{path}/start"), Some(&tag), &json!({})).await;
    assert_eq!(stale.status, StatusCode::PRECONDITION_FAILED);
    let bad = send(&service, Method::POST, &format!("{path}/start"), Some("seven"), &json!({})).await;
    assert_eq!(bad.status, StatusCode::PRECONDITION_FAILED);
    assert_eq!(send(&service, Method::PATCH, &path, None, &json!({"priority": 11})).await.json()["field"], "priority");
    let started = send(&service, Method::POST, &format!("{path}/start"), Some(&newer), &json!({"reason": "go"})).await;
    assert_eq!((started.status, &started.json()["state_reason"]), (StatusCode::OK, &json!("go")));
    service.stop().await;
}

#[tokio::test]
async fn finished_study_is_extended_cloned_and_compared() {
    let (folder, service) = service().await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let path = format!("/api/v1/studies/{study}");
    let less = service.post(&format!("{path}/extend"), &json!({"number_of_trials": 3})).await;
    assert_eq!((less.status, &less.json()["allowed"]), (StatusCode::UNPROCESSABLE_ENTITY, &json!("4 to 10000")));
    let more = service.post(&format!("{path}/extend"), &json!({"number_of_trials": 5})).await;
    assert_eq!((more.status, &more.json()["state"]), (StatusCode::OK, &json!("running")), "{}", more.text);
    service.wait_for(study, &[StudyState::Finished]).await;
    assert_eq!(service.trials(study).await.len(), 5);

    let clone = service.post(&format!("{path}/clone"), &json!({"seed": 9, "start": true})).await;
    assert_eq!(clone.status, StatusCode::CREATED, "{}", clone.text);
    let clone = clone.json();
    assert_eq!(
        (&clone["cloned_from"], &clone["seed"], &clone["number_of_trials"]),
        (&json!(study), &json!(9), &json!(5))
    );
    let cloned: StudyId = clone["id"].as_str().unwrap().parse().unwrap();
    service.wait_for(cloned, &[StudyState::Finished]).await;
    service.stop().await;
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 2).await;
    let computed = || service.scheduler.analyses().computed();
    let comparison = format!("/api/v1/study-comparison?ids={study},{cloned}");
    let first = service.fetch(&format!("{comparison}&limit=1")).await.json();
    assert_eq!(computed(), 1, "a page needs the posteriors of its studies only");
    let next = format!("{comparison}&limit=1&cursor={}", first["next"].as_str().unwrap());
    let both = service.fetch(&comparison).await.items();
    assert_eq!(computed(), 2, "a posterior is computed once");
    assert_eq!((&first["items"][0], &service.fetch(&next).await.items()[0]), (&both[0], &both[1]));
    assert_eq!((&both[0]["id"], &both[1]["trials"]["total"]), (&json!(study), &json!(5)));
    assert!(both[0]["best_gait_rmse_rad"].is_f64());
    let mut six = vec![study, cloned];
    for _ in 0..4 {
        six.push(service.study(|new| new.start = false).await);
    }
    let of_six = six.iter().map(StudyId::to_string).collect::<Vec<_>>().join(",");
    let (mut found, mut cursor) = (Vec::new(), String::new());
    for expected in [5, 1] {
        let path = format!("/api/v1/study-comparison?ids={of_six}&limit=1000{cursor}");
        let page = service.fetch(&path).await.json();
        let rows = page["items"].as_array().unwrap();
        assert_eq!(rows.len(), expected, "a page has five studies at most, whatever its limit");
        found.extend(rows.iter().map(|row| row["id"].clone()));
        cursor = page["next"].as_str().map_or_else(String::new, |next| format!("&cursor={next}"));
    }
    assert_eq!((json!(found), cursor.as_str()), (json!(six), ""));
    for ids in [study.to_string(), format!("{study},{study}"), vec![study.to_string(); 21].join(",")] {
        let refused = service.fetch(&format!("/api/v1/study-comparison?ids={ids}")).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{ids}");
        assert_eq!(refused.json()["field"], "ids");
    }
    let draft = service.study(|new| new.start = false).await;
    let unsolved = service.fetch(&format!("/api/v1/study-comparison?ids={draft},{study}")).await.items();
    assert!(unsolved[0]["solve_seconds"].as_f64().unwrap().is_sign_positive(), "{}", unsolved[0]);
    service.stop().await;
}

#[tokio::test]
async fn study_ends_by_solve_time_or_unchanged_best_action() {
    let (_folder, service) = service().await;
    // Every analytic solve reports 0.01 s; a budget is at least one second.
    let timed = service.study(|new| (new.number_of_trials, new.solve_seconds_budget) = (400, Some(1.0))).await;
    let settled = service.study(|new| (new.number_of_trials, new.unchanged_limit) = (400, Some(6))).await;
    let settled = service.wait_for(settled, &[StudyState::Finished]).await;
    assert!(settled.state_reason.contains("has not changed over the last 6 results"), "{}", settled.state_reason);
    let timed = service.wait_for(timed, &[StudyState::Finished]).await;
    assert!(timed.state_reason.contains("the limit is 1 s"), "{}", timed.state_reason);
    let trials = service.trials(timed.id).await.len();
    assert!((100..=101).contains(&trials), "{trials}");
    service.stop().await;
}

#[tokio::test]
async fn people_compare_trials_of_a_lab_script() {
    let (_folder, service) = service().await;
    let study = service
        .study(|new| {
            (new.evaluation, new.answer_source, new.number_of_trials) = (Evaluation::Script, AnswerSource::People, 4);
        })
        .await;
    let ask = format!("/api/v1/studies/{study}/ask");
    for _ in 0..2 {
        let trial = service.post(&ask, &json!({})).await.json();
        let tell = format!("/api/v1/trials/{}/tell", trial["id"].as_str().unwrap());
        assert_eq!(service.post(&tell, &json!({"label": "converged"})).await.status, StatusCode::OK);
    }
    service.wait_for(study, &[StudyState::Waiting]).await;
    assert_eq!(service.post(&ask, &json!({})).await.status, StatusCode::CONFLICT, "first the answer");
    let trials = service.trials(study).await;
    let answer = json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "b", "author": "S01"});
    assert_eq!(
        service.post(&format!("/api/v1/studies/{study}/preferences"), &answer).await.status,
        StatusCode::CREATED
    );
    service.wait_for(study, &[StudyState::Running]).await;
    assert_eq!(service.post(&ask, &json!({})).await.status, StatusCode::CREATED);
    service.stop().await;
}

#[tokio::test]
async fn trial_without_convergence_counts_in_its_batch_and_is_not_compared() {
    let (_folder, service) = service().await;
    // Batches of three, each action compared with the others of its batch and the newest before it.
    let study = service
        .study(|new| {
            (new.evaluation, new.number_of_trials) = (Evaluation::Script, 5);
            (new.learner.partner, new.learner.buffer, new.learner.samples_per_iteration) = (Partner::Previous, 1, 3);
        })
        .await;
    for number in 1..=5 {
        let trial = service.post(&format!("/api/v1/studies/{study}/ask"), &json!({})).await.json();
        let told = match number {
            2 | 4 => json!({"label": "not_converged", "reason": "the foot scuffed"}),
            _ => json!({"label": "converged", "gait_rmse_rad": 1.0 / f64::from(number)}),
        };
        let tell = format!("/api/v1/trials/{}/tell", trial["id"].as_str().unwrap());
        assert_eq!(service.post(&tell, &told).await.status, StatusCode::OK);
    }
    let numbers: HashMap<_, _> =
        service.trials(study).await.into_iter().map(|trial| (trial.id, trial.number)).collect();
    let compared: Vec<(u32, u32)> = service
        .feedback(study)
        .await
        .iter()
        .filter_map(|row| match row.content {
            FeedbackContent::Preference { winner, loser } => Some((numbers[&winner], numbers[&loser])),
            _ => None,
        })
        .collect();
    // Trials 1 to 3 are a batch; 4 and 5 begin the next, before which 3 is the newest with a gait.
    assert_eq!(compared, [(3, 1), (5, 3)]);
    service.stop().await;
}
