//! A user who answers the comparisons of a study.

use crate::service::Service;
use gaitwright_service::studies::pending_comparison::pending_comparison;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::studies::StudyState;
use gaitwright_store::{StudyId, TrialId};
use serde_json::json;
use std::time::Duration;

/// The comparison that a study waits for, with the newest gait first. Waits until there is one.
pub async fn asked(service: &Service, study: StudyId) -> (TrialId, TrialId) {
    for _ in 0..2000 {
        // After an answer a study is waiting for a moment longer.
        let study = service.wait_for(study, &[StudyState::Waiting]).await;
        let snapshot = StudySnapshot::read(&mut service.store.read().await.unwrap(), study).await.unwrap();
        let pending = service.store.clone().compute(move |pool| pending_comparison(pool, &snapshot)).await.unwrap();
        if let Some(trials) = pending.unwrap().trials() {
            return trials;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    panic!("the study asks nothing");
}

/// Answers it as Gait RMSE would: the lower one is better.
pub async fn answer_once(service: &Service, study: StudyId) {
    let (a, b) = asked(service, study).await;
    let trials = service.trials(study).await;
    let rmse = |id| trials.iter().find(|trial| trial.id == id).unwrap().gait_rmse_rad;
    let answer = if rmse(a) < rmse(b) { "a" } else { "b" };
    let given = json!({"trial_a": a, "trial_b": b, "answer": answer, "author": "S01"});
    let kept = service.post(&format!("/api/v1/studies/{study}/preferences"), &given).await;
    assert!(kept.status.is_success(), "{}", kept.text);
}
