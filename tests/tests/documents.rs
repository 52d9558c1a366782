//! Served documents have exactly the properties that the description of the REST interface gives them.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gait_optimizer::{CancelToken, IterationRecord, SolveOutcome};
use gaitwright_service::workers::{Assignment, Evaluate};
use gaitwright_store::studies::StudyState;
use gaitwright_tests::consistent_gaits::Consistent;
use gaitwright_tests::described::Description;
use gaitwright_tests::measured::four_strides;
use gaitwright_tests::service::Service;
use serde_json::{Map, Value, json};

/// Complete gaits, whose warm starts have tightened bounds.
#[derive(Debug, Default)]
struct Tightened(Consistent);

impl Evaluate for Tightened {
    fn evaluate(
        &self,
        assignment: &Assignment,
        observer: &mut dyn FnMut(&IterationRecord),
        cancel: &CancelToken,
    ) -> Result<SolveOutcome, String> {
        let mut outcome = self.0.evaluate(assignment, observer, cancel)?;
        let margins = json!({"variables": [[2, [0.1, 0.0]]], "rows": [[1, 0.2]]});
        outcome.warm_start.margins = serde_json::from_value(margins).unwrap();
        Ok(outcome)
    }
}

/// A value for every property of an object: the middle of its range, or its last word.
fn filled(schema: &Value) -> Value {
    if let Some(words) = schema["enum"].as_array() {
        return words.last().unwrap().clone();
    }
    let kind = schema["type"][0].as_str().or(schema["type"].as_str()).unwrap();
    match kind {
        "boolean" => json!(true),
        "integer" => json!(3),
        "number" => {
            let end = |name: &str| schema[name].as_f64().unwrap();
            json!(f64::midpoint(end("minimum"), end("maximum").min(1e3)))
        }
        _ => {
            let properties = schema["properties"].as_object().unwrap();
            properties.iter().map(|(name, property)| (name.clone(), filled(property))).collect::<Map<_, _>>().into()
        }
    }
}

#[tokio::test]
async fn served_documents_have_exactly_the_described_properties() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Tightened::default(), 1).await;
    let mut described = Description::read();

    let measured = json!({
        "name": "our own", "format": "csv", "recording": four_strides(100), "height_m": 1.7,
        "body_mass_kg": 70,
    });
    let made = service.post("/api/v1/reference-gaits", &measured).await;
    assert!(made.status.is_success(), "{}", made.text);
    for reference in service.fetch("/api/v1/reference-gaits").await.items().as_array().unwrap() {
        described.hold_named("ReferenceGait", reference);
    }
    for device in service.fetch("/api/v1/devices").await.items().as_array().unwrap() {
        described.hold_named("Device", device);
    }
    let subject = service.subject().await;
    let muscles = filled(described.component("MuscleParameters"));
    let set = service.put(&format!("/api/v1/subjects/{subject}/muscles"), &muscles).await;
    assert!(set.status.is_success(), "{}", set.text);
    described.hold_named("MuscleParameters", &set.json());

    let solver = filled(&described.component("SolveOptions")["properties"]["solver"]);
    let nearest = json!({"nearest_to_reference": {"within_percent": 5}});
    let with_muscles = json!({
        "subject_id": subject, "number_of_trials": 2, "muscles": true,
        "gait_settings": {"naturalness": {"reference_weight": 1, "trailing_load_share": 0.1}},
        "solve_options": {"solver": solver, "time_limit_s": 60, "local_optimum_choice": nearest},
    });
    let numbered = json!({"local_optimum_choice": {"numbered": {"number": 1}}});
    let without_muscles =
        json!({"subject_id": subject, "number_of_trials": 2, "muscles": false, "solve_options": numbered});
    for study in [with_muscles, without_muscles] {
        let made = service.post("/api/v1/studies", &study).await;
        assert!(made.status.is_success(), "{}", made.text);
        let id = made.json()["id"].as_str().unwrap().parse().unwrap();
        described.hold_named("StudyWithCommands", &service.fetch(&format!("/api/v1/studies/{id}")).await.json());
        service.wait_for(id, &[StudyState::Finished]).await;
        for trial in service.trials(id).await {
            for (component, document) in
                [("GaitDocument", "gait"), ("SolveProblem", "problem.json"), ("ControllerFile", "controller.json")]
            {
                let served = service.fetch(&format!("/api/v1/trials/{}/{document}", trial.id)).await;
                assert!(served.status.is_success(), "{document}: {}", served.text);
                described.hold_named(component, &served.json());
            }
        }
    }
    for component in [
        "ReferenceGait",
        "Device",
        "MuscleParameters",
        "SolveOptions",
        "GaitDocument",
        "SolveProblem",
        "ControllerFile",
    ] {
        let unseen = described.unseen(component);
        assert!(unseen.is_empty(), "no served {component} has {unseen:?}");
    }
    service.stop().await;
}
