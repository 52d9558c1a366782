//! A trial with the problem and the start of an earlier solve takes its result, in whichever study it was found.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::studies::StudyState;
use gaitwright_store::{StudyId, attempts, commit, gaits};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use std::sync::Arc;

/// Results of the trials of a study in the record, and the names of their workers.
async fn results(service: &Service, study: StudyId) -> (Vec<String>, Vec<String>) {
    let (mut found, mut workers) = (Vec::new(), Vec::new());
    for trial in service.trials(study).await {
        let mut reader = service.store.read().await.unwrap();
        let gait = gaits::get(&mut reader, trial.id).await.unwrap();
        let start = gaits::warm_start(&mut reader, trial.id).await.unwrap();
        let iterations = gaits::iterations(&mut reader, trial.id).await.unwrap();
        let unpack =
            move |pool: &_| format!("{:?} {:?} {:?}", gait.unpack(pool), start.unpack(pool), iterations.unpack(pool));
        let stored = service.store.clone().compute(unpack).await.unwrap();
        found.push(format!("{:?} {:?} {:?} {:?} {stored}", trial.action, trial.state, trial.report, trial.violations));
        workers
            .extend(attempts::of_trial(&mut reader, trial.id).await.unwrap().into_iter().map(|attempt| attempt.worker));
    }
    (found, workers)
}

async fn finished(service: &Service, name: &str) -> StudyId {
    let study = service.study(|new| (new.number_of_trials, new.name) = (6, Some(name.to_owned()))).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    study
}

#[tokio::test(flavor = "multi_thread")]
async fn study_of_the_same_problem_takes_earlier_results_without_a_solve() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic::default();
    let made = Arc::clone(&solver.made);
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let solved = || made.lock().unwrap().len();
    let first = finished(&service, "first").await;
    let (expected, workers) = results(&service, first).await;
    assert!(workers.iter().all(|worker| worker != "earlier solve"), "{workers:?}");
    let iterations = solved();
    assert!(iterations > 0);

    let second = finished(&service, "second").await;
    let (found, workers) = results(&service, second).await;
    assert_eq!(found, expected);
    assert!(workers.iter().all(|worker| worker == "earlier solve"), "{workers:?}");
    assert_eq!(solved(), iterations);
    let trials = service.trials(second).await;
    assert!(trials.iter().all(|trial| trial.message.ends_with("an earlier solve of the same problem.")), "{trials:?}");

    // Without the gaits, the trials are solved again, and their results serve the next study.
    let mut writer = service.store.write().await.unwrap();
    for study in [first, second] {
        gaits::drop_of_study(&mut writer, study, &[]).await.unwrap();
    }
    commit(writer).await.unwrap();
    let third = finished(&service, "third").await;
    assert_eq!(solved(), 2 * iterations);
    let fourth = finished(&service, "fourth").await;
    assert_eq!(solved(), 2 * iterations);
    assert_eq!(results(&service, third).await.0, expected);
    assert_eq!(results(&service, fourth).await.0, expected);
    service.stop().await;
}
