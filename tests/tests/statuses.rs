//! The statuses in the description are those of the operations. Every refusal that does not depend on the state of the
//! record is provoked here, for every operation.
//!
//! Rights are in `access.rs`, withdrawn consent is in `consent.rs`, bodies beyond the description in `random_bodies.rs`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::Request;
use gaitwright_http::openapi;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// A service with one object of most kinds, and their identifiers by the start of their addresses.
struct Scene {
    _folder: tempfile::TempDir,
    service: Service,
    ids: BTreeMap<&'static str, String>,
    schemas: Value,
}

impl Scene {
    async fn set() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
        let study = service.study(|new| (new.number_of_trials, new.answer_source) = (6, AnswerSource::Both)).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let mut trials = service.trials(study).await;
        trials.retain(|trial| trial.state == TrialState::Converged);
        let (one, two) = (trials[0].id, trials[1].id);
        let api = format!("/api/v1/studies/{study}");
        let made = async |path: String, body: Value| {
            let answer = service.post(&path, &body).await;
            assert!(answer.status.is_success(), "{path}: {}", answer.text);
            answer.json()["id"].as_str().unwrap().to_owned()
        };
        let preference = json!({"trial_a": one, "trial_b": two, "answer": "a"});
        let assessment = json!({"trial_a": one, "trial_b": two, "answer": "cannot_tell", "author": "somebody else"});
        let suggestion = json!({"over": two, "bounds": trials[2].action});
        let user = made("/api/v1/users".to_owned(), json!({"name": "Ada", "role": "rater"})).await;
        let ids = BTreeMap::from([
            ("subjects", service.subject().await.to_string()),
            ("studies", study.to_string()),
            ("trials", one.to_string()),
            ("jobs", format!("solve-{one}")),
            ("preferences", made(format!("{api}/preferences"), preference).await),
            ("assessments", made(format!("{api}/assessments"), assessment).await),
            ("suggestions", made(format!("{api}/suggestions"), suggestion).await),
            ("lab-sessions", made(format!("{api}/lab-sessions"), json!({"trial_a": one, "trial_b": two})).await),
            ("users", user),
            ("study-members", made(format!("{api}/members"), json!({"kind": "user", "name": "Ada"})).await),
            ("tokens", made("/api/v1/tokens".to_owned(), json!({"name": "t", "scopes": ["read"]})).await),
            ("devices", service.fetch("/api/v1/devices").await.items()[0]["id"].as_str().unwrap().to_owned()),
        ]);
        let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
        Self { _folder: folder, service, ids, schemas: document["components"]["schemas"].clone() }
    }

    /// The address of an operation, of something that is there where the scene has one.
    fn address(&self, path: &str) -> String {
        let start = path.split('/').nth(3).unwrap_or_default();
        let id = self.ids.get(start).map_or(UNKNOWN, String::as_str);
        path.replace("{id}", id)
            .replace("{code}", &"0".repeat(64))
            .replace("{file}", "a.svg")
            .replace("{side}", "first")
    }

    async fn send(&self, method: &str, address: &str, headers: &[(&str, &str)], body: String) -> u16 {
        let mut request = Request::builder().method(method.to_uppercase().as_str()).uri(address);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let answer = self.service.send(request.body(Body::from(body)).unwrap()).await;
        answer.status.as_u16()
    }

    fn resolved<'a>(&'a self, schema: &'a Value) -> &'a Value {
        match schema["$ref"].as_str() {
            Some(name) => self.resolved(&self.schemas[name.rsplit('/').next().unwrap()]),
            None => schema,
        }
    }

    /// A value that fits a schema; identifiers are those of the scene.
    fn example(&self, name: &str, schema: &Value) -> Value {
        let schema = self.resolved(schema);
        if let Some(first) = schema["enum"].get(0) {
            return first.clone();
        }
        if let Some(first) = schema["oneOf"].get(0) {
            return self.example(name, first);
        }
        let id = match name {
            "subject_id" => "subjects",
            "trial_a" | "over" => "trials",
            _ => "",
        };
        match schema["type"].as_str().unwrap_or("string") {
            "object" => {
                let needed = schema["required"].as_array().cloned().unwrap_or_default();
                let field = |name: &Value| {
                    let name = name.as_str().unwrap().to_owned();
                    let value = self.example(&name, &schema["properties"][&name]);
                    (name, value)
                };
                Value::Object(needed.iter().map(field).collect())
            }
            "array" => json!([self.example(name, &schema["items"])]),
            "boolean" => json!(true),
            "integer" | "number" => schema.get("minimum").cloned().unwrap_or(json!(1)),
            _ if schema["format"] == "uuid" => json!(self.ids.get(id).map_or(UNKNOWN, String::as_str)),
            _ => json!("x"),
        }
    }
}

/// Nothing has this identifier.
const UNKNOWN: &str = "01890000-0000-7000-8000-000000000000";

#[tokio::test]
async fn described_refusals_occur() {
    let scene = Scene::set().await;
    let json_body = [("content-type", "application/json")];
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let (mut missing, mut provoked) = (Vec::new(), 0);
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            let address = scene.address(path);
            let schema = &operation["requestBody"]["content"]["application/json"]["schema"];
            let example = if schema.is_null() { String::new() } else { scene.example("", schema).to_string() };
            let unknown = path.replace("{id}", UNKNOWN).replace("{code}", "unknown").replace("{side}", "first");
            let unknown = unknown.replace("{file}", "a.svg");
            for status in operation["responses"].as_object().unwrap().keys() {
                let got = match status.as_str() {
                    "400" if method != "get" => vec![
                        scene
                            .send(
                                method,
                                &address,
                                &[("content-type", "application/json"), ("idempotency-key", "\u{e9}")],
                                example.clone(),
                            )
                            .await,
                    ],
                    "400" => {
                        vec![scene.send(method, &format!("{address}?no_such_parameter=1"), &[], String::new()).await]
                    }
                    "404" if path.contains('{') => {
                        vec![scene.send(method, &unknown, &json_body, example.clone()).await]
                    }
                    "412" => vec![
                        scene.send(method, &address, &[json_body[0], ("if-match", "\"0\"")], example.clone()).await,
                    ],
                    "413" => vec![scene.send(method, &address, &json_body, "x".repeat(17 << 20)).await],
                    "415" => {
                        vec![scene.send(method, &address, &[("content-type", "text/plain")], example.clone()).await]
                    }
                    "422" if method == "get" && is_page(operation) => {
                        vec![scene.send(method, &format!("{address}?limit=0"), &[], String::new()).await]
                    }
                    _ => continue,
                };
                provoked += 1;
                let refusal = format!("{method} {path} {status}");
                if !got.iter().any(|one| one.to_string() == *status) {
                    missing.push(format!("{refusal}: {got:?}"));
                }
            }
        }
    }
    assert!(missing.is_empty() && provoked > 300, "{provoked} provoked; never given: {missing:#?}");
    scene.service.stop().await;
}

fn is_page(operation: &Value) -> bool {
    operation["parameters"].as_array().is_some_and(|all| all.iter().any(|one| one["name"] == "cursor"))
}
