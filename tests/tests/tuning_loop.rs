//! The automatic tuning loop: the rows it records, and resumption after an interruption at any point.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_learner::{Dimension, LearnerSettings, Method, Partner, SearchSpace};
use gaitwright_service::studies::pending_comparison::pending_comparison;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::study_plan::NewStudy;
use gaitwright_service::workers::{Attempt, InProcess};
use gaitwright_store::feedback::{FeedbackContent, Source};
use gaitwright_store::studies::{AnswerSource, StudyState, WarmStartFrom};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{StudyId, trials};
use gaitwright_tests::analytic::{Analytic, inactive_bound};
use gaitwright_tests::engine_without_workers::Away;
use gaitwright_tests::service::Service;
use serde_json::json;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::time::Duration;

/// Values that must be the same in two runs with the same seed: everything but identifiers and times.
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
    let study = service.study(|new| (new.seed, new.number_of_trials) = (seed, trials)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let seen = essence(&service.trials(study).await);
    service.stop().await;
    seen
}

#[tokio::test]
async fn study_ends_with_its_number_of_trials_and_gives_the_reason_of_each_trial() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let learner =
        LearnerSettings { partner: Partner::Previous, buffer: 1, repeats: false, ..LearnerSettings::default() };
    let study = service.study(|new| (new.number_of_trials, new.learner) = (15, learner)).await;
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
    let labels = feedback.iter().filter(|row| matches!(row.content, FeedbackContent::Label { .. })).count();
    assert_eq!(labels, 15);
    let mut last: Option<&Trial> = None;
    let mut compared = 0;
    for trial in &trials {
        let answers: Vec<_> = feedback
            .iter()
            .filter(|row| row.source == Source::GaitRmse)
            .filter(|row| match row.content {
                FeedbackContent::Preference { winner, loser } => {
                    let newer = if winner > loser { winner } else { loser };
                    newer == trial.id
                }
                _ => false,
            })
            .collect();
        match (trial.state, last) {
            (TrialState::Converged, Some(before)) => {
                assert_eq!(answers.len(), 1, "trial {}", trial.number);
                compared += 1;
                let better = if trial.gait_rmse_rad < before.gait_rmse_rad { trial.id } else { before.id };
                assert!(matches!(answers[0].content, FeedbackContent::Preference { winner, .. } if winner == better));
            }
            _ => assert!(answers.is_empty(), "trial {}", trial.number),
        }
        if trial.state == TrialState::Converged {
            last = Some(trial);
        }
    }
    assert!(compared > 5, "{compared}");
    // Every warm start begins at a converged gait.
    assert!(trials.iter().filter(|trial| trial.warm_started_from.is_some()).count() > 5, "{trials:?}");
    for trial in &trials {
        if let Some(from) = trial.warm_started_from {
            assert!(trials.iter().any(|t| t.id == from && t.state == TrialState::Converged));
        }
    }
    service.stop().await;
}

/// The values of the bounds that the analytic solver uses.
fn used(trial: &Trial) -> [u64; 4] {
    let a = trial.action;
    [a.a1, a.a5, a.a6, a.a7].map(f64::to_bits)
}

#[tokio::test]
async fn study_of_thirty_trials_has_no_gait_twice_unless_results_may_repeat() {
    let folder = tempfile::tempdir().unwrap();
    let engine = Analytic { states_unchanged_bounds: true, ..Analytic::default() };
    let service = Service::start(&folder.path().join("a.db"), engine, 1).await;
    for method in [Method::LineCoSpar, Method::Eubo, Method::Thompson, Method::InformationGain] {
        for repeats in [false, true] {
            let study = service
                .study(|new| {
                    (new.number_of_trials, new.seed) = (30, 5);
                    (new.learner, new.repeat_results) = (LearnerSettings::of(method), Some(repeats));
                })
                .await;
            service.wait_for(study, &[StudyState::Finished]).await;
            let trials = service.trials(study).await;
            assert_eq!(trials.len(), 30);
            let converged = trials.iter().filter(|trial| trial.state == TrialState::Converged);
            let distinct: HashSet<_> = converged.clone().map(used).collect();
            assert_eq!(distinct.len() < converged.count(), repeats, "{method:?}");
            let page = service.fetch(&format!("/studies/{study}")).await.text;
            assert!(page.contains("Bounds that were not active in any gait: a2, a3, a4, a8."), "{page}");
            let recommendation = loop {
                let found = service.fetch(&format!("/api/v1/studies/{study}/recommendation")).await;
                if found.status == StatusCode::OK {
                    break found.json();
                }
                tokio::time::sleep(Duration::from_millis(10)).await;
            };
            assert_eq!(recommendation["never_active"], json!(["a2", "a3", "a4", "a8"]));
        }
    }
    service.stop().await;
}

#[tokio::test]
async fn gait_page_lists_the_values_that_leave_the_gait_unchanged() {
    let folder = tempfile::tempdir().unwrap();
    let engine = Analytic { states_unchanged_bounds: true, ..Analytic::default() };
    let service = Service::start(&folder.path().join("a.db"), engine, 1).await;
    let study = service.study(|new| new.number_of_trials = 1).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await[0].id;
    let page = service.fetch(&format!("/trials/{trial}")).await.text;
    assert_eq!(page.matches("any value").count(), 4, "{page}");
    assert_eq!(page.matches("this value only").count(), 4, "{page}");
    service.stop().await;
}

#[tokio::test]
async fn study_ends_when_the_gait_of_every_action_is_known() {
    let folder = tempfile::tempdir().unwrap();
    let engine = Analytic { states_unchanged_bounds: true, ..Analytic::default() };
    let service = Service::start(&folder.path().join("a.db"), engine, 1).await;
    for (repeats, expected) in [(None, 1), (Some(false), 1), (Some(true), 3)] {
        let study = service
            .study(|new| {
                (new.search_space, new.number_of_trials) = (Some(inactive_bound().into()), 30);
                new.repeat_results = repeats;
            })
            .await;
        let ended = service.wait_for(study, &[StudyState::Finished]).await;
        assert_eq!(service.trials(study).await.len(), expected);
        assert_eq!(ended.state_reason.contains("has the same gait as one that has"), expected == 1, "{ended:?}");
    }
    service.stop().await;
}

#[tokio::test]
async fn gaits_from_a_root_do_not_depend_on_other_trials() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 2).await;
    let mut roots = HashSet::new();
    for (seed, parallel_trials) in [(1, 1), (2, 1), (3, 2)] {
        let study = service
            .study(|new| {
                (new.seed, new.number_of_trials, new.parallel_trials) = (seed, 8, parallel_trials);
                new.warm_start_from = WarmStartFrom::Root;
            })
            .await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let trials = service.trials(study).await;
        assert_eq!(trials.len(), 8);
        let root = trials.iter().find(|trial| trial.state == TrialState::Converged).unwrap();
        assert_eq!((root.number, root.warm_started_from), (1, None));
        for trial in &trials[1..] {
            assert_eq!(trial.warm_started_from, Some(root.id), "trial {}", trial.number);
        }
        roots.insert((root.action_index, root.gait_rmse_rad.map(f64::to_bits)));
    }
    assert_eq!(roots.len(), 1, "the root depends on the problem only");
    service.stop().await;
}

#[tokio::test]
async fn jump_to_another_local_optimum_is_stated_on_pages_and_through_rest() {
    let of_root = ["", "with looser bounds, trial 1 has an objective of 0.300", "Found by a cold start"];
    let of_last = ["", "", "with stricter bounds, trial "];
    for (jumps, cold_after_warm, base_a2, expected) in [(1, vec![3], 90.0, of_root), (3, Vec::new(), 70.0, of_last)] {
        let folder = tempfile::tempdir().unwrap();
        let engine = Analytic { jumps: vec![jumps], cold_after_warm, ..Analytic::default() };
        let service = Service::start(&folder.path().join("a.db"), engine, 1).await;
        let study = service
            .study(|new| {
                new.base_bounds.a2 = base_a2;
                (new.search_space, new.repeat_results) = (Some(inactive_bound().into()), Some(true));
                (new.number_of_trials, new.warm_start_from) = (3, WarmStartFrom::Root);
            })
            .await;
        service.wait_for(study, &[StudyState::Finished]).await;
        for (trial, expected) in service.trials(study).await.iter().zip(expected) {
            assert_eq!(trial.state, TrialState::Converged);
            let served = service.fetch(&format!("/api/v1/trials/{}", trial.id)).await.json();
            assert_eq!(served["message"], json!(trial.message));
            assert!(trial.message.contains(expected), "{:?}, expected {expected:?}", trial.message);
            assert_eq!(trial.message.is_empty(), expected.is_empty(), "{:?}", trial.message);
            let page = service.fetch(&format!("/trials/{}", trial.id)).await.text;
            assert!(page.contains(&trial.message), "{page}");
        }
        service.stop().await;
    }
}

#[tokio::test]
async fn published_learner_repeats_results_by_default() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    for (learner, expected) in
        [(LearnerSettings::default(), false), (LearnerSettings::published(Method::LineCoSpar), true)]
    {
        let study = service.study(|new| new.learner = learner.clone()).await;
        let ended = service.wait_for(study, &[StudyState::Finished]).await;
        assert_eq!(ended.plan.repeat_results, expected);
    }
    service.stop().await;
}

#[tokio::test]
async fn equal_seeds_give_equal_trials_and_different_seeds_different_ones() {
    let first = undisturbed(7, 12).await;
    assert_eq!(first, undisturbed(7, 12).await);
    assert_ne!(first, undisturbed(8, 12).await);
}

#[tokio::test]
async fn study_interrupted_during_solves_continues_with_the_same_trials() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let slow = || Analytic::slow(Duration::from_millis(2));
    let mut service = Service::start(&database, slow(), 1).await;
    let study: StudyId = service.study(|new| (new.seed, new.number_of_trials) = (7, 12)).await;
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
async fn panicking_solve_is_retried_then_fails_and_never_reaches_the_learner() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic { panics: vec![2], panics_once: vec![1], ..Analytic::default() };
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let study = service.study(|new| new.number_of_trials = 4).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    assert!(trials[0].state.is_result(), "one panic is forgiven");
    assert_eq!(trials[1].state, TrialState::Failed);
    assert!(trials[1].message.contains("panics"), "{}", trials[1].message);
    let feedback = service.feedback(study).await;
    assert!(
        feedback
            .iter()
            .all(|row| !matches!(row.content, FeedbackContent::Label { trial, .. } if trial == trials[1].id))
    );
    service.stop().await;
}

#[tokio::test]
async fn three_failures_in_a_row_pause_a_study() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic { panics: (1..100).collect(), ..Analytic::default() };
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let study = service.study(|new| new.number_of_trials = 10).await;
    let paused = service.wait_for(study, &[StudyState::Paused]).await;
    assert!(paused.state_reason.contains("3 trials in a row failed"), "{}", paused.state_reason);
    assert_eq!(service.trials(study).await.len(), 3);
    service.stop().await;
}

#[tokio::test]
async fn workers_and_studies_share_the_pool_without_repeated_jobs() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 3).await;
    let mut studies = Vec::new();
    for seed in 1..4 {
        studies.push(service.study(|new| (new.seed, new.number_of_trials, new.parallel_trials) = (seed, 10, 2)).await);
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

/// Waits until an engine has this number of jobs.
async fn handed_over(engine: &Away, jobs: usize) -> Vec<Attempt> {
    for _ in 0..2000 {
        let present = engine.jobs.lock().unwrap().clone();
        if present.len() == jobs {
            return present;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    panic!("the engine has {:?}", engine.jobs.lock().unwrap());
}

#[tokio::test]
async fn higher_priorities_run_first_and_equal_ones_share() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    // Made while nothing is handed out, so that the first plan sees all of them.
    let engine = Away::default();
    let service = Service::start_with(&database, Arc::new(engine)).await;
    let mut studies = Vec::new();
    for (seed, priority) in [(1, 0), (2, 0), (3, 5)] {
        let new = |new: &mut NewStudy| {
            (new.seed, new.priority, new.number_of_trials, new.parallel_trials) =
                (seed, priority, 9, 2 + u32::from(seed < 3));
        };
        studies.push(service.study(new).await);
    }
    service.stop().await;
    let engine = Away { size: 6, ..Away::default() };
    let service = Service::start_with(&database, Arc::new(engine.clone())).await;
    let mut order = Vec::new();
    for attempt in handed_over(&engine, 6).await {
        let study = trials::get(&mut service.store.read().await.unwrap(), attempt.trial).await.unwrap().study_id;
        order.push(studies.iter().position(|known| *known == study).unwrap());
    }
    assert_eq!(order[..2], [2, 2], "by priority");
    // Which of two equal studies comes first depends on whose plan was made first: they are planned apart.
    for turn in order[2..].chunks(2) {
        assert!(turn == [0, 1] || turn == [1, 0], "whoever has the fewest: {order:?}");
    }
    service.stop().await;
}

#[tokio::test]
async fn pause_cancels_jobs_that_have_not_started() {
    let folder = tempfile::tempdir().unwrap();
    let engine = Away { size: 2, ..Away::default() };
    let service = Service::start_with(&folder.path().join("a.db"), Arc::new(engine.clone())).await;
    let study = service.study(|new| (new.number_of_trials, new.parallel_trials) = (4, 2)).await;
    handed_over(&engine, 2).await;
    let path = format!("/api/v1/studies/{study}");
    assert_eq!(service.post(&format!("{path}/pause"), &json!({})).await.status, StatusCode::OK);
    handed_over(&engine, 0).await;
    tokio::time::sleep(Duration::from_millis(200)).await;
    assert!(handed_over(&engine, 0).await.is_empty(), "nothing new starts");
    assert!(service.trials(study).await.iter().all(|trial| trial.state == TrialState::Queued));
    assert_eq!(service.post(&format!("{path}/resume"), &json!({})).await.status, StatusCode::OK);
    let again = handed_over(&engine, 2).await;
    assert!(again.iter().all(|attempt| attempt.number == 2), "{again:?}");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn cancelled_solve_stops_within_one_iteration() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic::slow(Duration::from_millis(100));
    let made = Arc::clone(&solver.made);
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let study = service.study(|new| new.number_of_trials = 1).await;
    while made.lock().unwrap().len() < 2 {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let trial = service.trials(study).await[0].id;
    assert_eq!(service.post(&format!("/api/v1/trials/{trial}/cancel"), &json!({})).await.status, StatusCode::OK);
    let before = made.lock().unwrap().len();
    tokio::time::sleep(Duration::from_millis(500)).await;
    let after = made.lock().unwrap().len();
    assert!(after <= before + 1, "{before} iterations when it was cancelled, {after} later");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn trial_of_vanished_workers_is_lost_and_can_be_retried() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic { hangs: 3, ..Analytic::default() };
    let engine = InProcess::new(1, Arc::new(solver)).with_lease(Duration::from_millis(600));
    let service = Service::start_with(&folder.path().join("a.db"), Arc::new(engine)).await;
    let study = service.study(|new| new.number_of_trials = 1).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await.remove(0);
    assert_eq!(trial.state, TrialState::Lost);
    assert!(trial.message.contains("worker's lease expired"), "{}", trial.message);
    assert!(service.feedback(study).await.is_empty(), "what was lost is no result");

    let path = format!("/api/v1/studies/{study}/extend");
    assert_eq!(service.post(&path, &json!({"number_of_trials": 2})).await.status, StatusCode::OK);
    let path = format!("/api/v1/trials/{}/retry", trial.id);
    assert_eq!(service.post(&path, &json!({})).await.status, StatusCode::ACCEPTED);
    service.wait_for(study, &[StudyState::Finished]).await;
    assert!(service.trials(study).await.iter().all(|trial| trial.state.is_result()));
    service.stop().await;
}

#[tokio::test]
async fn equal_gaits_are_never_offered_for_comparison() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service
        .study(|new| {
            new.search_space = Some(inactive_bound().into());
            new.learner = LearnerSettings { partner: Partner::Previous, buffer: 1, ..LearnerSettings::default() };
            (new.number_of_trials, new.answer_source) = (3, AnswerSource::People);
        })
        .await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let [first, second] = service.trials(study).await.try_into().unwrap();
    let answer = json!({"trial_a": first.id, "trial_b": second.id, "answer": "a", "author": "S01"});
    service.post(&format!("/api/v1/studies/{study}/preferences"), &answer).await;
    // The third gait is that of the second, which has been compared with the first.
    service.wait_for(study, &[StudyState::Finished]).await;
    let third = service.trials(study).await.remove(2);
    assert_eq!((third.warm_started_from, second.warm_started_from), (Some(first.id), Some(first.id)));
    assert_eq!(third.gait_rmse_rad, second.gait_rmse_rad);
    service.stop().await;
}

#[tokio::test]
async fn people_compare_two_gaits_once_whatever_actions_have_them() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    for (seed, partner) in (1..).zip([Partner::Incumbent, Partner::Previous, Partner::Every]) {
        let study = service
            .study(|new| {
                let swing = Dimension { name: "a6".to_owned(), values: vec![0.2, 0.3, 0.4], lengthscale: 0.1 };
                let dimensions = [inactive_bound().dimensions(), &[swing]].concat();
                new.search_space = Some(SearchSpace::new(dimensions).unwrap().into());
                new.learner = LearnerSettings { partner, buffer: 3, repeats: false, ..LearnerSettings::default() };
                (new.repeat_results, new.warm_start_from) = (Some(true), WarmStartFrom::Root);
                (new.seed, new.number_of_trials, new.answer_source) = (seed, 9, AnswerSource::People);
            })
            .await;
        let mut asked = HashSet::new();
        while service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await.state == StudyState::Waiting {
            let snapshot =
                StudySnapshot::read(&mut service.store.read().await.unwrap(), service.get(study).await).await.unwrap();
            let trials = snapshot.trials.clone();
            let pending = service.store.clone().compute(move |pool| pending_comparison(pool, &snapshot)).await.unwrap();
            let Some((a, b)) = pending.unwrap().trials() else {
                tokio::time::sleep(Duration::from_millis(5)).await;
                continue;
            };
            let of = |id| trials.iter().find(|trial| trial.id == id).unwrap().gait_rmse_rad.unwrap();
            let (least, most) = (of(a).min(of(b)), of(a).max(of(b)));
            assert!(least < most, "a gait is compared with itself");
            assert!(
                asked.insert((least.to_bits(), most.to_bits())),
                "{partner:?}: asked again about {least} and {most}"
            );
            let answer = if of(a) < of(b) { "a" } else { "b" };
            let answer = json!({"trial_a": a, "trial_b": b, "answer": answer, "author": "S01"});
            service.post(&format!("/api/v1/studies/{study}/preferences"), &answer).await;
        }
        assert_eq!(service.trials(study).await.len(), 9);
        assert!(!asked.is_empty());
    }
    service.stop().await;
}
