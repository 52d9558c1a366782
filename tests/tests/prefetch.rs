//! Prefetching: while a person decides, the solves that may follow run already. The trials are the same as without
//! prefetching.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_service::studies::pending_comparison::pending_comparison;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::attempts;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::json;
use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

/// The trials of a study with this delay before each answer, and which of them were prefetched.
async fn tuned(thinks: Duration) -> (Vec<String>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::slow(Duration::from_millis(4)), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (7, AnswerSource::People)).await;
    loop {
        let present = service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await;
        if present.state == StudyState::Finished {
            break;
        }
        tokio::time::sleep(thinks).await;
        let snapshot = StudySnapshot::read(&mut service.store.read().await.unwrap(), present).await.unwrap();
        let there = snapshot.clone();
        let pending = service.store.clone().compute(move |pool| pending_comparison(pool, &there)).await.unwrap();
        let Some((a, b)) = pending.unwrap().trials() else { continue };
        let rmse = |id| snapshot.trial(id).unwrap().gait_rmse_rad.unwrap();
        let answer = json!({"trial_a": a, "trial_b": b, "answer": if rmse(a) < rmse(b) { "a" } else { "b" }});
        let given = service.post(&format!("/api/v1/studies/{study}/preferences"), &answer).await;
        assert!(given.status.is_success(), "{}", given.text);
    }
    let trials = service.trials(study).await;
    let (mut essence, mut workers) = (Vec::new(), Vec::new());
    for t in &trials {
        let from = t.warm_started_from.map(|from| trials.iter().find(|other| other.id == from).unwrap().number);
        let rmse = t.gait_rmse_rad.map(f64::to_bits);
        essence.push(format!("{} {} {:?} {rmse:?} {from:?} {}", t.number, t.action_index, t.state, t.reason));
        let brought = attempts::of_trial(&mut service.store.read().await.unwrap(), t.id).await.unwrap();
        assert_eq!(brought.len(), 1, "{brought:?}");
        assert!(brought[0].used);
        workers.push(brought[0].worker.clone());
    }
    service.stop().await;
    (essence, workers)
}

#[tokio::test(flavor = "multi_thread")]
async fn prefetching_changes_no_trial_and_removes_the_wait() {
    let (at_once, _) = Box::pin(tuned(Duration::ZERO)).await;
    let (thoughtful, workers) = Box::pin(tuned(Duration::from_millis(1500))).await;
    assert_eq!(at_once.len(), 7);
    assert_eq!(thoughtful, at_once);
    assert!(workers.iter().any(|worker| worker == "prepared"), "{workers:?}");
    // Somewhere in the middle of a solve, which goes on for the trial that asks for it.
    assert_eq!(Box::pin(tuned(Duration::from_millis(60))).await.0, at_once);
}

#[tokio::test(flavor = "multi_thread")]
async fn prefetched_solve_gives_way_within_one_iteration() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic::slow(Duration::from_millis(40));
    let made = Arc::clone(&solver.made);
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let human = service.study(|new| (new.number_of_trials, new.answer_source) = (6, AnswerSource::People)).await;
    service.wait_for(human, &[StudyState::Waiting]).await;
    let known: HashSet<_> = service.trials(human).await.iter().map(|trial| trial.id).collect();
    let begun = made.lock().unwrap().len();
    let prepares = || made.lock().unwrap()[begun..].iter().any(|trial| !known.contains(trial));
    while !prepares() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }

    let wanted = service.study(|new| (new.number_of_trials, new.seed) = (1, 9)).await;
    service.wait_for(wanted, &[StudyState::Finished]).await;
    let wanted = service.trials(wanted).await[0].id;
    let made = made.lock().unwrap().clone();
    let first = made.iter().position(|trial| *trial == wanted).unwrap();
    let last = made.iter().rposition(|trial| *trial == wanted).unwrap();
    let others = made[first..last].iter().filter(|trial| **trial != wanted).count();
    assert!(others <= 1, "{others} iterations of what nobody waits for ran beside a trial");
    service.stop().await;
}
