//! The gaits that the initial guesses of a trial led to are on record and on its page, and each can be the root gait of
//! another study.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gait_optimizer::LocalOptimumChoice;
use gaitwright_store::studies::{StudyState, WarmStartFrom};
use gaitwright_store::{StudyId, commit, gaits, other_local_optima};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};

async fn finished(service: &Service, name: &str) -> StudyId {
    let study = service
        .study(|new| {
            (new.number_of_trials, new.name) = (3, Some(name.to_owned()));
            new.warm_start_from = WarmStartFrom::Root;
        })
        .await;
    service.wait_for(study, &[StudyState::Finished]).await;
    study
}

async fn local_optima(service: &Service, trial: impl std::fmt::Display) -> Vec<Value> {
    let listed = service.fetch(&format!("/api/v1/trials/{trial}/local-optima")).await.items();
    listed.as_array().unwrap().clone()
}

#[tokio::test(flavor = "multi_thread")]
async fn gaits_of_all_local_optima_are_served_and_start_other_studies() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic { other_local_optima: 2, ..Analytic::default() };
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let study = finished(&service, "first").await;
    let trials = service.trials(study).await;
    let (root, later) = (trials[0].id, trials[1].id);
    let found = local_optima(&service, root).await;
    let of = |name: &str| -> Vec<Value> { found.iter().map(|one| one[name].clone()).collect() };
    assert_eq!(of("number"), [1, 2, 3]);
    assert_eq!(of("is_result"), [true, false, false]);
    assert_eq!(found[0]["gait_rmse_rad"].as_f64(), trials[0].gait_rmse_rad);
    assert!(local_optima(&service, later).await.is_empty(), "a warm start reaches no other local optimum");

    let gait = format!("/api/v1/trials/{root}/gait");
    let own = service.fetch(&gait).await.json();
    let second = service.fetch(&format!("{gait}?local_optimum=2")).await.json();
    assert!(second["domains"].is_array() && second != own);
    for missing in ["1", "4"] {
        assert_eq!(service.fetch(&format!("{gait}?local_optimum={missing}")).await.status, StatusCode::NOT_FOUND);
    }
    let page = service.fetch(&format!("/trials/{root}")).await.text;
    for number in [2, 3] {
        let figure = format!("/api/v1/trials/{root}/figures/walking.svg?local_optimum={number}");
        assert!(page.contains(&figure), "{page}");
        let svg = service.fetch(&figure).await;
        assert!(svg.status == StatusCode::OK && svg.text.starts_with("<svg"), "{}", svg.text);
        assert!(page.contains(&format!("/studies/new?like={study}&amp;local_optimum={number}")), "{page}");
    }
    let both = format!("/api/v1/trials/{root}/figures/walking.svg?local_optimum=2&other={later}");
    assert_eq!(service.fetch(&both).await.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert!(!service.fetch(&format!("/trials/{later}")).await.text.contains("Local optimum"));
    let form = service.fetch(&format!("/studies/new?like={study}&local_optimum=3")).await.text;
    assert!(form.contains(r#"name="local_optimum" value="3""#), "{form}");

    let options = json!({"local_optimum_choice": {"numbered": {"number": 3}}});
    let body = json!({"subject_id": service.subject().await, "solve_options": options, "warm_start_from": "root"});
    let new = service.post("/api/v1/studies", &body).await;
    assert_eq!(new.status, StatusCode::CREATED, "{}", new.text);
    let id: StudyId = new.json()["id"].as_str().unwrap().parse().unwrap();
    let plan = service.wait_for(id, &[StudyState::Running, StudyState::Waiting, StudyState::Finished]).await.plan;
    assert_eq!(plan.solve_options.local_optimum_choice, LocalOptimumChoice::Numbered { number: 3 });
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn local_optima_are_copied_with_earlier_results_and_pruned_with_the_gait() {
    let folder = tempfile::tempdir().unwrap();
    let solver = Analytic { other_local_optima: 1, ..Analytic::default() };
    let service = Service::start(&folder.path().join("a.db"), solver, 1).await;
    let first = service.trials(finished(&service, "first").await).await[0].id;
    let second = finished(&service, "second").await;
    let again = service.trials(second).await[0].id;
    assert_eq!(local_optima(&service, again).await, local_optima(&service, first).await);
    let mut writer = service.store.write().await.unwrap();
    gaits::drop_of_study(&mut writer, second, &[]).await.unwrap();
    other_local_optima::drop_without_gait(&mut writer, second).await.unwrap();
    commit(writer).await.unwrap();
    assert!(local_optima(&service, again).await.is_empty());
    let mut reader = service.store.read().await.unwrap();
    assert!(other_local_optima::of_trial(&mut reader, again).await.unwrap().is_empty());
    assert_eq!(other_local_optima::of_trial(&mut reader, first).await.unwrap().len(), 1);
    drop(reader);
    service.stop().await;
}
