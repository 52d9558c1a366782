//! A study that makes an atlas, and studies that take their gaits from it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gait_learner::{Dimension, SearchSpace};
use gaitwright_service::studies::atlas;
use gaitwright_service::studies::study_plan::NewStudy;
use gaitwright_store::studies::{AtlasRole, StudyState, WarmStartFrom};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{StudyId, attempts};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers::FORM;
use gaitwright_tests::service::Service;
use serde_json::json;
use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;
use std::time::Duration;

/// The solver of these tests uses a1, a5, a6 and a7, and finds no gait with a5 = 0.039 and a6 = 0.1.
fn space() -> SearchSpace {
    let dimension = |(name, values): (&str, &[f64])| Dimension {
        name: name.to_owned(),
        values: values.to_vec(),
        lengthscale: values[1] - values[0],
    };
    let dimensions: [(&str, &[f64]); 6] = [
        ("a1", &[15.0, 20.0]),
        ("a2", &[70.0, 80.0, 90.0]),
        ("a3", &[0.3, 0.4, 0.5]),
        ("a5", &[0.0, 0.013, 0.026, 0.039]),
        ("a6", &[0.1, 0.3, 0.5]),
        ("a8", &[20.0, 30.0, 40.0]),
    ];
    SearchSpace::new(dimensions.map(dimension).to_vec()).unwrap()
}

fn solver() -> Analytic {
    Analytic { states_unchanged_bounds: true, ..Analytic::default() }
}

async fn made(service: &Service, change: impl FnOnce(&mut NewStudy)) -> StudyId {
    let atlas = service.study(|new| {
        new.search_space = Some(space().into());
        *new = atlas::atlas_of(new.clone());
        change(new);
    });
    atlas.await
}

/// Values that distinguish the gaits of this solver; `None` without a gait.
fn gait(trial: &Trial) -> Option<[u64; 3]> {
    let bounds = &trial.action;
    trial.state.has_gait().then(|| [bounds.a1, bounds.a5, bounds.a6].map(f64::to_bits))
}

/// Every bit of the results of trials, by number.
fn results(trials: &[Trial]) -> Vec<(u64, TrialState, Option<u64>, Option<u64>)> {
    let bits = |value: Option<f64>| value.map(f64::to_bits);
    trials.iter().map(|t| (t.action_index.0, t.state, bits(t.gait_rmse_rad), bits(t.objective))).collect()
}

async fn workers(service: &Service, trials: &[Trial]) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for trial in trials {
        let found = attempts::of_trial(&mut service.store.read().await.unwrap(), trial.id).await.unwrap();
        names.extend(found.into_iter().map(|attempt| attempt.worker));
    }
    names
}

#[tokio::test(flavor = "multi_thread")]
async fn atlas_has_every_gait_whatever_the_number_of_workers_and_interruptions() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), solver(), 1).await;
    let study = made(&service, |new| new.parallel_trials = 1).await;
    let ended = service.wait_for(study, &[StudyState::Finished]).await;
    assert!(ended.state_reason.starts_with("Every action of the search space"), "{ended:?}");
    let expected = service.trials(study).await;
    let gaits: HashSet<[u64; 3]> = expected.iter().filter_map(gait).collect();
    // 2 values of a1, and 11 of 12 combinations of a5 and a6.
    assert_eq!(gaits.len(), 22);
    let without: Vec<&Trial> = expected.iter().filter(|trial| !trial.state.has_gait()).collect();
    assert_eq!(without.len(), 2 * 3 * 3 * 3, "actions without a gait have no known gait");
    // A batch can find a gait twice.
    assert!((76..130).contains(&expected.len()), "{}", expected.len());
    assert!(expected[1..].iter().all(|trial| trial.warm_started_from == Some(expected[0].id)));
    let plan = ended.plan.clone();
    let trials = expected.clone();
    let count = move |pool: &_| atlas::progress(pool, &plan, &trials);
    let progress = service.store.clone().compute(count).await.unwrap();
    assert_eq!((progress.actions, progress.with_result, progress.with_gait), (648, 648, 594));
    assert_eq!((progress.gaits, progress.solves, progress.solves_left), (22, expected.len() as u64, 0));
    service.stop().await;

    let database = folder.path().join("b.db");
    let slow = || Analytic { pause: Duration::from_millis(1), ..solver() };
    let service = Service::start(&database, slow(), 2).await;
    let study = made(&service, |_| {}).await;
    service.wait_for_trials(study, 20).await;
    service.abandon().await;
    let service = Service::start(&database, slow(), 2).await;
    assert!(service.trials(study).await.len() < expected.len());
    service.wait_for(study, &[StudyState::Finished]).await;
    let mut found = service.trials(study).await;
    found.sort_by_key(|trial| trial.number);
    assert_eq!(results(&found), results(&expected));
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn study_takes_every_gait_from_the_atlas_without_a_solve() {
    let folder = tempfile::tempdir().unwrap();
    let engine = solver();
    let solved = Arc::clone(&engine.made);
    let service = Service::start(&folder.path().join("a.db"), engine, 2).await;
    let study = made(&service, |_| {}).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let atlas: HashSet<u64> = service.trials(study).await.iter().map(|trial| trial.action_index.0).collect();
    let before = solved.lock().unwrap().len();
    for (seed, parallel_trials) in [(3, 1), (4, 4)] {
        let study = service
            .study(|new| {
                (new.search_space, new.seed, new.parallel_trials) = (Some(space().into()), seed, parallel_trials);
                (new.number_of_trials, new.warm_start_from, new.atlas) = (20, WarmStartFrom::Root, AtlasRole::Use);
            })
            .await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let trials = service.trials(study).await;
        assert_eq!(trials.len(), 20);
        assert_eq!(workers(&service, &trials).await, BTreeSet::from(["earlier solve".to_owned()]));
        assert!(trials[1..].iter().all(|trial| trial.reason.ends_with("; its gait is in the atlas")), "{trials:?}");
        assert!(trials.iter().all(|trial| trial.message.contains("an earlier solve") || !trial.state.has_gait()));
        assert!(trials.iter().all(|trial| atlas.contains(&trial.action_index.0)));
        let gaits: Vec<[u64; 3]> = trials.iter().filter_map(gait).collect();
        assert_eq!(gaits.iter().collect::<HashSet<_>>().len(), gaits.len(), "a gait was tried twice");
    }
    assert_eq!(solved.lock().unwrap().len(), before);

    // Without an atlas of its own problem, a study solves its trials.
    let other = service
        .study(|new| {
            (new.search_space, new.number_of_trials) = (Some(space().into()), 2);
            (new.warm_start_from, new.atlas, new.base_bounds.a4) = (WarmStartFrom::Root, AtlasRole::Use, 1.3);
        })
        .await;
    service.wait_for(other, &[StudyState::Finished]).await;
    assert!(solved.lock().unwrap().len() > before);
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn atlas_is_made_and_shown_through_rest_and_pages() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), solver(), 2).await;
    let study = service.study(|new| (new.search_space, new.start) = (Some(space().into()), false)).await;
    let api = |study: &str| format!("/api/v1/studies/{study}");
    let refused = service.fetch(&format!("{}/atlas", api(&study.to_string()))).await;
    assert_eq!(refused.status, 409, "{}", refused.text);
    let page = service.fetch(&format!("/studies/{study}/atlas")).await.text;
    assert!(page.contains("Make the atlas of this study"), "{page}");

    let made =
        service.post(&format!("{}/clone", api(&study.to_string())), &json!({"atlas": "make", "start": true})).await;
    assert_eq!(made.status, 201, "{}", made.text);
    let made = made.json();
    assert_eq!(made["atlas"], "make");
    let atlas = made["id"].as_str().unwrap();
    service.wait_for(atlas.parse().unwrap(), &[StudyState::Finished]).await;
    let served = service.fetch(&format!("{}/atlas", api(atlas))).await.json();
    let count = |name: &str| served[name].as_u64().unwrap();
    assert_eq!(
        ["actions", "actions_with_result", "actions_with_gait", "gaits", "solves_left"].map(count),
        [648, 648, 594, 22, 0]
    );
    let trials = service.trials(atlas.parse().unwrap()).await;
    let best = trials.iter().filter_map(|trial| trial.gait_rmse_rad).min_by(f64::total_cmp).unwrap();
    assert_eq!(served["best_gait_rmse_rad"], json!(best));
    assert_eq!(served["best_certified_gait_rmse_rad"], json!(best));

    let table = service.fetch(&format!("{}/atlas.csv", api(atlas))).await.text;
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0][..8], ["a1", "a2", "a3", "a5", "a6", "a8", "gait", "trial"], "{table}");
    assert_eq!(rows.len(), 1 + 648);
    let number = |bounds: &[&str]| rows.iter().find(|row| row[..6] == *bounds).unwrap()[6];
    assert_eq!(number(&["15", "70", "0.3", "0.013", "0.3", "20"]), number(&["15", "90", "0.5", "0.013", "0.3", "40"]));
    assert_ne!(number(&["15", "70", "0.3", "0.013", "0.3", "20"]), number(&["20", "70", "0.3", "0.013", "0.3", "20"]));
    assert_eq!(number(&["15", "70", "0.3", "0.039", "0.1", "20"]), "");
    assert_eq!(rows[0][8..13], ["status", "iterations", "objective", "cost_of_transport", "gait_rmse_rad"]);
    assert_eq!(
        rows[0][13..],
        [
            "gait_rmse_other_rad",
            "speed_m_s",
            "stride_length_m",
            "double_support_percent",
            "step_time_asymmetry",
            "peak_hip_torque_nm_kg",
            "active"
        ]
    );
    for row in &rows[1..] {
        let filled = row[10..19].iter().filter(|cell| cell.parse::<f64>().is_ok()).count();
        // The solver of this test makes gaits without contact forces, from which nothing more can be computed.
        assert_eq!(filled, if row[6].is_empty() { 0 } else { 3 }, "{row:?}");
    }

    let page = service.fetch(&format!("/studies/{atlas}/atlas?x=a5&y=a6")).await.text;
    for part in
        ["648 of 648 actions have a result", "Active bounds", ">no gait<", "Lowest Gait RMSE with a passed certificate"]
    {
        assert!(page.contains(part), "{part}: {page}");
    }
    let wrong = service.fetch(&format!("/studies/{atlas}/atlas?x=a5&y=a5")).await;
    assert_eq!(wrong.status, 422, "{}", wrong.text);
    service.stop().await;
}

#[tokio::test]
async fn form_of_a_new_study_offers_gaits_from_an_atlas() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), solver(), 1).await;
    let subject = service.subject().await;
    let form = |more: &str| {
        let rest = "muscles=on&answer_source=gait_rmse&parallel_trials=1&number_of_trials=1&seed=1&tuned_a5=on";
        format!("subject={subject}&{rest}&{more}")
    };
    let refused = service.post_text("/studies/new", FORM, &form("use_atlas=on&repeat_results=on")).await;
    assert_eq!(refused.status, 422, "{}", refused.text);
    assert!(refused.text.contains("\u{201c}Repeat known results\u{201d} must be false"), "{}", refused.text);
    let made = service.post_text("/studies/new", FORM, &form("use_atlas=on")).await;
    assert_eq!(made.status, 303, "{}", made.text);
    let study: StudyId = made.headers["location"].to_str().unwrap().rsplit('/').next().unwrap().parse().unwrap();
    let plan = service.get(study).await.plan;
    assert_eq!((plan.atlas, plan.warm_start_from), (AtlasRole::Use, WarmStartFrom::Root));
    let clone = service.fetch(&format!("/studies/new?like={study}")).await.text;
    assert!(clone.contains("name=\"use_atlas\" value=\"on\" checked"), "{clone}");
    service.stop().await;
}

#[tokio::test]
async fn contradictory_roles_of_an_atlas_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), solver(), 1).await;
    let subject_id = service.subject().await;
    for (more, field) in [
        (json!({}), "warm_start_from"),
        (json!({"warm_start_from": "root", "repeat_results": true}), "repeat_results"),
        (json!({"warm_start_from": "root", "evaluation": "script"}), "atlas"),
    ] {
        for role in ["make", "use"] {
            let mut body = json!({"subject_id": subject_id, "atlas": role, "start": false});
            body.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
            let refused = service.post("/api/v1/studies", &body).await;
            assert_eq!(refused.status, 422, "{}", refused.text);
            assert_eq!(refused.json()["field"], json!(field), "{}", refused.text);
        }
    }
    let body = json!({"subject_id": subject_id, "atlas": "make", "warm_start_from": "root", "answer_source": "people"});
    let refused = service.post("/api/v1/studies", &body).await;
    assert_eq!((refused.status.as_u16(), refused.json()["field"].clone()), (422, json!("answer_source")));
    service.stop().await;
}

#[tokio::test]
async fn atlas_without_a_root_gait_ends_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), solver(), 1).await;
    let study = made(&service, |new| {
        let clearance = Dimension { name: "a5".to_owned(), values: vec![0.036, 0.039], lengthscale: 0.003 };
        let speed = Dimension { name: "a6".to_owned(), values: vec![0.0, 0.1], lengthscale: 0.1 };
        new.search_space = Some(SearchSpace::new(vec![clearance, speed]).unwrap().into());
    });
    let ended = service.wait_for(study.await, &[StudyState::Finished]).await;
    assert_eq!(ended.state_reason, "The first trial found no gait, so the atlas has no root gait.");
    service.stop().await;
}
