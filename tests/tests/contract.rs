//! Formats that scripts rely on: names and types, not values.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_service::studies::analysis::Analyses;
use gaitwright_service::studies::certified_best::BestCertification;
use gaitwright_service::studies::recommended_trial::ranking_to_show;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::summary;
use gaitwright_store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::{Map, Value};

/// The type of every leaf; of a list, the shape of its first entry.
fn shape(value: &Value) -> Value {
    match value {
        Value::Null => "null".into(),
        Value::Bool(_) => "bool".into(),
        Value::Number(_) => "number".into(),
        Value::String(_) => "string".into(),
        Value::Array(list) => list.first().map_or_else(|| Value::Array(Vec::new()), |v| vec![shape(v)].into()),
        Value::Object(fields) => {
            Value::Object(fields.iter().map(|(k, v)| (k.clone(), shape(v))).collect::<Map<_, _>>())
        }
    }
}

#[tokio::test]
async fn documents_keep_their_shape() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(
        &folder.path().join("a.db"),
        Analytic { states_unchanged_bounds: true, ..Analytic::default() },
        1,
    )
    .await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    let present = service.wait_for(study, &[StudyState::Finished]).await;
    let snapshot = StudySnapshot::read(&mut service.store.read().await.unwrap(), present).await.unwrap();

    // tune --json; the last trial comes first, because it has everything.
    let there = snapshot.clone();
    let rank = service.store.clone().compute(move |pool| ranking_to_show(pool, &there, &Analyses::default())).await;
    let best = rank.unwrap().unwrap().first().copied();
    let mut tune = serde_json::to_value(summary::of(&snapshot, best, BestCertification::default(), None)).unwrap();
    tune["trials"].as_array_mut().unwrap().reverse();
    insta::assert_json_snapshot!("tune", shape(&tune));

    // solve --json.
    let trial = &snapshot.trials[2];
    insta::assert_json_snapshot!("solve", shape(&serde_json::to_value(trial.report.as_ref().unwrap()).unwrap()));

    for (name, path) in [
        ("health", "/health".to_owned()),
        ("subjects", "/api/v1/subjects".to_owned()),
        ("studies", "/api/v1/studies".to_owned()),
        ("trial", format!("/api/v1/trials/{}", trial.id)),
        ("history", format!("/api/v1/studies/{study}/history")),
        ("preferences", format!("/api/v1/studies/{study}/preferences")),
        ("motion", format!("/api/v1/trials/{}/motion", trial.id)),
        ("iterations", format!("/api/v1/trials/{}/iterations", trial.id)),
        ("problem", "/api/v1/trials/none".to_owned()),
    ] {
        insta::assert_json_snapshot!(name, shape(&service.fetch(&path).await.json()));
    }
    service.stop().await;
}

#[test]
fn statuses_keep_their_names() {
    use gait_optimizer::SolveStatus::{Cancelled, Converged, Infeasible, IterationLimit, Stalled, TimeLimit};
    let names = [Converged, Infeasible, Stalled, IterationLimit, TimeLimit, Cancelled]
        .map(|status| serde_json::to_value(status).unwrap());
    assert_eq!(names, ["converged", "infeasible", "stalled", "iteration_limit", "time_limit", "cancelled"]);
}
