//! The automatic tuning loop: what it records, and that it goes on after an end at any point.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gait_learner::{LearnerSettings, Partner};
use gaitwright::store::StudyId;
use gaitwright::store::feedback::{Said, Source};
use gaitwright::store::studies::StudyState;
use gaitwright::store::trials::{Trial, TrialState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use std::collections::HashMap;
use std::time::Duration;

/// What must be the same in two runs with the same seed: everything but identifiers and times.
fn essence(trials: &[Trial]) -> Vec<String> {
    let number: HashMap<_, _> = trials.iter().map(|trial| (trial.id, trial.number)).collect();
    trials
        .iter()
        .map(|t| {
            format!(
                "{} {} {:?} {:?} rmse {:?} from {:?} best {:?}",
                t.number,
                t.action_index,
                t.state,
                t.reason,
                t.gait_rmse_rad.map(f64::to_bits),
                t.warm_started_from.map(|id| number[&id]),
                t.best_before.map(|id| number[&id]),
            )
        })
        .collect()
}

async fn undisturbed(seed: u64, trials: u32) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.seed, new.trial_budget) = (seed, trials)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let seen = essence(&service.trials(study).await);
    service.stop().await;
    seen
}

#[tokio::test]
async fn a_study_ends_with_its_budget_and_says_why_each_trial_is() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let learner =
        LearnerSettings { partner: Partner::Previous, buffer: 1, repeats: false, ..LearnerSettings::default() };
    let study = service.study(|new| (new.trial_budget, new.learner) = (15, learner)).await;
    service.wait_for(study, &[StudyState::Finished]).await;

    let trials = service.trials(study).await;
    assert_eq!(trials.len(), 15);
    assert!(trials.iter().all(|trial| trial.state.is_result()));
    assert!(trials[0].warm_started_from.is_none() && trials[0].best_before.is_none());
    let mut actions: Vec<_> = trials.iter().map(|trial| trial.action_index).collect();
    actions.sort();
    actions.dedup();
    assert_eq!(actions.len(), 15, "no action is tried twice");

    // Each result has one label; each converged one is compared with the converged one recorded before it.
    let feedback = service.feedback(study).await;
    let labels = feedback.iter().filter(|row| matches!(row.said, Said::Label { .. })).count();
    assert_eq!(labels, 15);
    let mut last: Option<&Trial> = None;
    for trial in &trials {
        let answers: Vec<_> = feedback
            .iter()
            .filter(|row| row.source == Source::GaitRmse)
            .filter(|row| match row.said {
                Said::Preference { winner, loser } => {
                    let newer = if winner > loser { winner } else { loser };
                    newer == trial.id
                }
                _ => false,
            })
            .collect();
        match (trial.state, last) {
            (TrialState::Converged, Some(before)) => {
                assert_eq!(answers.len(), 1, "trial {}", trial.number);
                let better = if trial.gait_rmse_rad < before.gait_rmse_rad { trial.id } else { before.id };
                assert!(matches!(answers[0].said, Said::Preference { winner, .. } if winner == better));
            }
            _ => assert!(answers.is_empty(), "trial {}", trial.number),
        }
        if trial.state == TrialState::Converged {
            last = Some(trial);
        }
    }
    // Whoever starts warm starts from a converged gait.
    for trial in &trials {
        if let Some(from) = trial.warm_started_from {
            assert!(trials.iter().any(|t| t.id == from && t.state == TrialState::Converged));
        }
    }
    service.stop().await;
}

#[tokio::test]
async fn the_same_seed_gives_the_same_trials_and_another_one_others() {
    let first = undisturbed(7, 12).await;
    assert_eq!(first, undisturbed(7, 12).await);
    assert_ne!(first, undisturbed(8, 12).await);
}

#[tokio::test]
async fn a_study_stopped_in_the_middle_of_solves_goes_on_to_the_same_trials() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let slow = || Analytic::slow(Duration::from_millis(2));
    let mut service = Service::start(&database, slow(), 1).await;
    let study: StudyId = service.study(|new| (new.seed, new.trial_budget) = (7, 12)).await;
    for ended in [1, 4, 5, 9] {
        service.wait_for_trials(study, ended).await;
        // Somewhere in the middle of the next solve.
        tokio::time::sleep(Duration::from_millis(7)).await;
        service.stop().await;
        service = Service::start(&database, slow(), 1).await;
    }
    service.wait_for(study, &[StudyState::Finished]).await;
    assert_eq!(essence(&service.trials(study).await), undisturbed(7, 12).await);
    service.stop().await;
}

#[tokio::test]
async fn a_panic_is_tried_again_and_then_failed_and_never_heard_by_the_learner() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic { panics: vec![2], panics_once: vec![1], ..Analytic::default() };
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let study = service.study(|new| new.trial_budget = 4).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    assert!(trials[0].state.is_result(), "one panic is forgiven");
    assert_eq!(trials[1].state, TrialState::Failed);
    assert!(trials[1].message.contains("panics"), "{}", trials[1].message);
    let feedback = service.feedback(study).await;
    assert!(feedback.iter().all(|row| !matches!(row.said, Said::Label { trial, .. } if trial == trials[1].id)));
    service.stop().await;
}

#[tokio::test]
async fn three_failures_in_a_row_pause_a_study() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic { panics: (1..100).collect(), ..Analytic::default() };
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let study = service.study(|new| new.trial_budget = 10).await;
    let paused = service.wait_for(study, &[StudyState::Paused]).await;
    assert!(paused.state_reason.contains("3 trials in a row failed"), "{}", paused.state_reason);
    assert_eq!(service.trials(study).await.len(), 3);
    service.stop().await;
}

#[tokio::test]
async fn several_workers_and_studies_share_the_pool_without_doing_anything_twice() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 3).await;
    let mut studies = Vec::new();
    for seed in 1..4 {
        studies.push(service.study(|new| (new.seed, new.trial_budget, new.parallel_trials) = (seed, 10, 2)).await);
    }
    for study in studies {
        service.wait_for(study, &[StudyState::Finished]).await;
        let trials = service.trials(study).await;
        assert_eq!(trials.len(), 10);
        let mut actions: Vec<_> = trials.iter().map(|trial| trial.action_index).collect();
        actions.sort();
        actions.dedup();
        assert_eq!(actions.len(), 10);
    }
    service.stop().await;
}
