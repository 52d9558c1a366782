//! The description of the REST interface: complete, committed, and consistent with the service.
//!
//! `GAITWRIGHT_WRITE_OPENAPI=1 cargo test --workspace --locked --test openapi` accepts additions: it rewrites the
//! committed file. Changes that break clients need `GAITWRIGHT_WRITE_OPENAPI=breaks`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, StatusCode};
use gaitwright_http::openapi;
use gaitwright_store::studies::{AnswerSource, Evaluation, StudyState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::compatibility::{Difference, compare};
use gaitwright_tests::described::Description;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;

#[test]
fn committed_description_matches_the_code() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../server/openapi.json");
    let text = openapi::text().unwrap();
    let committed = std::fs::read_to_string(&file).unwrap();
    let [old, new]: [Value; 2] = [&committed, &text].map(|text| serde_json::from_str(text).unwrap());
    let Difference { breaks, additions } = compare(&old, &new);
    let accepted = std::env::var("GAITWRIGHT_WRITE_OPENAPI").unwrap_or_default();
    assert!(breaks.is_empty() || accepted == "breaks", "this breaks the clients of the REST interface: {breaks:#?}");
    if accepted.is_empty() {
        assert!(committed == text, "server/openapi.json is not up to date; additions: {additions:#?}");
    } else {
        std::fs::write(&file, &text).unwrap();
    }
}

#[test]
fn every_operation_describes_rights_parameters_and_responses() {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    assert!(document["openapi"].as_str().unwrap().starts_with("3.1"));
    let mut operations = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            operations += 1;
            let what = format!("{method} {path}");
            assert!(operation["summary"].as_str().is_some_and(|s| !s.is_empty()), "{what} has no summary");
            assert!(operation["security"].is_array() || path.ends_with("/health"), "{what} asks for no right");
            let named: Vec<&str> = operation["parameters"]
                .as_array()
                .into_iter()
                .flatten()
                .filter(|p| p["in"] == "path")
                .map(|p| p["name"].as_str().unwrap())
                .collect();
            let expected: Vec<&str> =
                path.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}')).collect();
            assert_eq!(named, expected, "{what}");
            if method != "get" {
                assert_ne!(takes_key(operation), operation["x-shown-once"] == true, "{what}");
            }
        }
    }
    assert!(operations > 30, "{operations}");
    // Every reference has a target.
    let text = document.to_string();
    for reference in text.split("\"$ref\":\"#/components/schemas/").skip(1) {
        let name = reference.split('"').next().unwrap();
        assert!(document["components"]["schemas"][name].is_object(), "{name}");
    }
}

fn takes_key(operation: &Value) -> bool {
    operation["parameters"].as_array().into_iter().flatten().any(|p| p["name"] == "Idempotency-Key")
}

#[tokio::test]
async fn repeated_change_with_a_key_happens_once_or_refuses_the_key_as_described() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (6, AnswerSource::Both)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let draft = service.study(|new| new.start = false).await.to_string();
    let subject = service.subject().await.to_string();
    let trials = service.trials(study).await;
    let (study, trial, other) = (study.to_string(), trials[0].id.to_string(), trials[1].id.to_string());
    let rater = service.post("/api/v1/users", &json!({"name": "R", "role": "rater"})).await.json();
    let rater = rater["id"].as_str().unwrap().to_owned();
    let id_of = |path: &str| match path {
        path if path.ends_with("/start") => draft.clone(),
        path if path.contains("/subjects/") => subject.clone(),
        path if path.contains("/studies/") => study.clone(),
        path if path.contains("/trials/") => trial.clone(),
        path if path.contains("/users/") => rater.clone(),
        _ => "01890000-0000-7000-8000-000000000000".to_owned(),
    };
    let body_of = |path: &str| match path.rsplit('/').next().unwrap() {
        "subjects" => json!({"pseudonym": "S9", "height_m": 1.8, "body_mass_kg": 70}),
        "consents" => json!({"form": "form 3"}),
        "corrections" => json!({"height_m": 1.8, "body_mass_kg": 70, "reason": "r"}),
        "studies" => json!({"subject_id": subject, "start": false}),
        "extend" => json!({"number_of_trials": 7}),
        "preferences" => json!({"trial_a": trial, "trial_b": other, "answer": "a"}),
        "assessments" => json!({"trial_a": trial, "trial_b": other, "answer": "cannot_tell"}),
        "users" => json!({"name": "K", "role": "clinician"}),
        "tokens" => json!({"name": "t", "scopes": ["read"]}),
        "invitations" => json!({"name": "guest"}),
        "access" => json!({"restricted": true}),
        _ => json!({}),
    };
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let (mut repeated, mut refused) = (0, 0);
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap().iter().filter(|(method, _)| *method != "get") {
            let address =
                path.replace("{id}", &id_of(path)).replace("{code}", &"0".repeat(64)).replace("{side}", "first");
            let send = async || {
                let request = Request::builder().method(method.to_uppercase().as_str()).uri(&address);
                let request =
                    request.header("content-type", "application/json").header("idempotency-key", path.as_str());
                service.send(request.body(Body::from(body_of(path).to_string())).unwrap()).await
            };
            let (first, what) = (send().await, format!("{method} {path}"));
            if !takes_key(operation) {
                assert_eq!(first.status, StatusCode::BAD_REQUEST, "{what}: {}", first.text);
                assert!(first.text.contains("Idempotency-Key"), "{what}: {}", first.text);
                refused += 1;
                continue;
            }
            assert!(!first.text.contains("Idempotency-Key"), "{what}: {}", first.text);
            if !first.status.is_success() {
                continue;
            }
            let second = send().await;
            assert_eq!((second.status, &second.text), (first.status, &first.text), "{what}");
            assert_eq!(second.headers["idempotency-replayed"], "true", "{what}");
            repeated += 1;
        }
    }
    assert!(repeated >= 14 && refused >= 2, "{repeated} repeated, {refused} refused");
    service.stop().await;
}

#[tokio::test]
async fn settings_at_the_ends_of_their_described_ranges_are_accepted() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let subject = service.subject().await;
    let mut tried = 0;
    for (group, place) in [
        ("gait_settings", "GaitSettings"),
        ("solve_options", "SolveOptions"),
        ("solve_options/solver", "SolveOptions/properties/solver"),
        ("learner", "LearnerSettings"),
    ] {
        let schema = document.pointer(&format!("/components/schemas/{place}")).unwrap();
        assert_eq!(schema["additionalProperties"], false, "{group}");
        for (name, field) in schema["properties"].as_object().unwrap() {
            assert!(field["type"] != "string" || field["enum"].is_array(), "{group}.{name}: its words are not named");
            let ends = [&field["minimum"], &field["maximum"]].into_iter().filter(|end| end.is_number());
            for end in ends.cloned().chain(field["enum"].as_array().cloned().into_iter().flatten()) {
                let integer = field["type"] == "integer";
                let end = if integer { end.as_f64().unwrap().to_string().parse().unwrap() } else { end };
                let mut body = json!({name: end});
                for part in group.split('/').rev() {
                    body = json!({part: body});
                }
                (body["subject_id"], body["start"]) = (json!(subject), json!(false));
                let answer = service.post("/api/v1/studies", &body).await;
                // Where settings depend on each other, the refusal names another one.
                let alone = answer.status.is_success() || !answer.text.contains(&format!("{name} is {end}"));
                assert!(alone, "{group}.{name} = {end}: {}", answer.text);
                tried += 1;
            }
        }
    }
    assert!(tried > 10, "{tried}");
    let invented = json!({"subject_id": subject, "learner": {"nothing": 1}});
    assert_eq!(service.post("/api/v1/studies", &invented).await.status, StatusCode::BAD_REQUEST);
    service.stop().await;
}

#[tokio::test]
async fn description_is_served_and_its_page_has_no_external_resources() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let served = service.fetch("/api/openapi.json").await;
    assert_eq!((served.status, served.text), (StatusCode::OK, openapi::text().unwrap()));
    let page = service.fetch("/api").await;
    assert_eq!(page.status, StatusCode::OK);
    assert!(page.text.contains("/api/v1/studies/{id}/preferences"));
    for elsewhere in ["http://", "https://", "//cdn"] {
        assert!(!page.text.contains(elsewhere), "{elsewhere}");
    }
    // The page names exactly the changes that refuse an Idempotency-Key.
    let sentence =
        page.text.split("<code>Idempotency-Key</code>, except").nth(1).unwrap().split("</p>").next().unwrap();
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut refusing = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap().iter().filter(|(method, _)| *method != "get") {
            let named = sentence.contains(&format!("<code>{} {path}</code>", method.to_uppercase()));
            assert_eq!(named, !takes_key(operation), "{method} {path}");
            refusing += usize::from(named);
        }
    }
    assert!(refusing >= 2, "{sentence}");
    service.stop().await;
}

#[tokio::test]
async fn responses_have_the_described_properties() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (12, AnswerSource::Both)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let script = service.study(|new| (new.number_of_trials, new.evaluation) = (3, Evaluation::Script)).await;
    service.post(&format!("/api/v1/studies/{script}/ask"), &json!({})).await;
    let trials = service.trials(study).await;
    let answer = json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "a"});
    let given = service.post(&format!("/api/v1/studies/{study}/preferences"), &answer).await.json();
    let given = given["id"].as_str().unwrap().to_owned();
    service.post(&format!("/api/v1/preferences/{given}/retract"), &json!({"reason": "r"})).await;
    let right = json!({"height_m": 1.75, "body_mass_kg": 70, "reason": "measured again"});
    service.post(&format!("/api/v1/subjects/{}/corrections", service.subject().await), &right).await;
    service.post("/api/v1/users", &json!({"name": "R", "role": "rater"})).await;
    service.post("/api/v1/tokens", &json!({"name": "t", "scopes": ["read"]})).await;

    let mut description = Description::read();
    let (study, script, trial) = (study.to_string(), script.to_string(), trials[0].id.to_string());
    let device = service.fetch("/api/v1/devices").await.items()[0]["id"].as_str().unwrap().to_owned();
    let reference = service.fetch("/api/v1/reference-gaits").await.items()[0]["id"].as_str().unwrap().to_owned();
    let subject = service.subject().await.to_string();
    for (path, id) in [
        ("/subjects", ""),
        ("/subjects/{id}", &subject),
        ("/devices", ""),
        ("/devices/{id}", &device),
        ("/reference-gaits", ""),
        ("/reference-gaits/{id}", &reference),
        ("/subjects/{id}/reference-gaits", &subject),
        ("/studies", ""),
        ("/studies/{id}", &study),
        ("/studies/{id}", &script),
        ("/studies/{id}/trials", &study),
        ("/studies/{id}/trials", &script),
        ("/studies/{id}/history", &study),
        ("/studies/{id}/preferences", &study),
        ("/studies/{id}/raters", &study),
        ("/studies/{id}/unblinded-pairs", &study),
        ("/trials/{id}", &trial),
        ("/trials/{id}/iterations", &trial),
        ("/trials/{id}/attempts", &trial),
        ("/trials/{id}/gait", &trial),
        ("/trials/{id}/motion", &trial),
        ("/preferences/{id}", &given),
        ("/me", ""),
        ("/users", ""),
        ("/tokens", ""),
        ("/audit", ""),
        ("/access-log", ""),
        ("/subjects/{id}/corrections", &subject),
        ("/health", ""),
    ] {
        let path = format!("/api/v1{path}");
        let answer = service.fetch(&path.replace("{id}", id)).await;
        assert_eq!(answer.status, StatusCode::OK, "{path} of {id}: {}", answer.text);
        description.hold(&path, &answer.json());
    }
    let missed = service.fetch(&format!("/api/v1/studies/{trial}")).await;
    description.hold_named("Problem", &missed.json());
    // Every schema that is declared separately was checked against the type that it describes.
    for shape in ["Bounds", "SearchSpace", "Dimension"] {
        assert!(description.seen.contains(shape), "{shape} was not seen among {:?}", description.seen);
    }
    service.stop().await;
}

/// Every list is a page, and every page has the same parameters.
#[test]
fn every_list_has_the_same_envelope_and_the_same_parameters() {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut lists = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            let what = format!("{method} {path}");
            for (status, answer) in operation["responses"].as_object().unwrap() {
                let schema = &answer["content"]["application/json"]["schema"];
                assert_ne!(schema["type"], "array", "{what} {status} answers a bare list");
            }
            let schema = &operation["responses"]["200"]["content"]["application/json"]["schema"];
            let Some(name) = schema["$ref"].as_str().and_then(|name| name.strip_prefix("#/components/schemas/")) else {
                continue;
            };
            let parameters = operation["parameters"].as_array().cloned().unwrap_or_default();
            let paging: Vec<&Value> =
                parameters.iter().filter(|one| ["cursor", "limit"].contains(&one["name"].as_str().unwrap())).collect();
            let fields = document["components"]["schemas"][name]["properties"].as_object();
            let fields: Vec<&String> = fields.into_iter().flat_map(serde_json::Map::keys).collect();
            let is_page = fields == ["items", "next"];
            assert_eq!((name.ends_with("Page"), paging.len()), (is_page, if is_page { 2 } else { 0 }), "{what}");
            lists += usize::from(is_page);
        }
    }
    assert!(lists > 20, "{lists}");
}

/// Lists of the service begin with the newest entry, and lists of one object with its first. Others say by what they are
/// sorted.
#[test]
fn every_list_states_its_order() {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut lists = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        let operation = &item["get"];
        if !operation["operationId"].as_str().is_some_and(|name| name.starts_with("list_")) {
            continue;
        }
        let text = operation["description"].as_str().unwrap_or_default().replace('\n', " ").to_lowercase();
        let usual = if path.contains("{id}") { "oldest first" } else { "newest first" };
        let other = if path.contains("{id}") { "newest first" } else { "oldest first" };
        let states = text.contains(usual) || text.contains("sorted by") || text.contains("sorted as");
        assert!(states && !text.contains(other), "{path}: {text}");
        lists += 1;
    }
    assert!(lists > 25, "{lists}");
}

/// The first word of an operation says what it does, and which success it has: 201 and the address of what it makes, 202
/// and the job, or 200. Every operation has a description beside its summary.
#[test]
fn operation_is_named_by_what_it_does_and_responds_accordingly() {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut made = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            let what = format!("{method} {path}");
            let verb = operation["operationId"].as_str().unwrap().split('_').next().unwrap();
            let summary = operation["summary"].as_str().unwrap().to_lowercase();
            assert!(
                operation["description"].as_str().is_some_and(|text| text.ends_with('.')),
                "{what} has no description"
            );
            let said = summary.split(' ').next().unwrap();
            assert!(said == verb || (verb, said) == ("get", "download"), "{what}: {verb}, but {summary}");
            let has = |status: &str| !operation["responses"][status].is_null();
            let (makes, defers) =
                (["create", "clone", "ask", "draw"].contains(&verb), ["request", "retry"].contains(&verb));
            assert_eq!((has("201"), has("202")), (makes, defers), "{what}");
            assert!(method == "get" || !["get", "list", "follow"].contains(&verb), "{what}");
            made += usize::from(makes);
        }
    }
    assert!(made > 20, "{made}");
}

/// Generators make a method of each: `list_studies`, `withdraw_consent`.
#[test]
fn operation_identifiers_are_unique() {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut known = BTreeSet::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            let identifier = operation["operationId"].as_str().unwrap();
            let reads_well = identifier.contains('_') && identifier.chars().all(|c| c.is_ascii_lowercase() || c == '_');
            assert!(reads_well && known.insert(identifier.to_owned()), "{method} {path}: {identifier}");
        }
    }
    assert!(known.len() > 100, "{}", known.len());
}

/// Bodies that fit a schema, drawn from it: ranges with their ends, texts that are never the same twice.
struct Drawn {
    state: u64,
    drawn: u64,
}

impl Drawn {
    /// A whole number below `end` (SplitMix64, Steele et al. 2014).
    fn below(&mut self, end: u64) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) % end
    }

    fn value(&mut self, schema: &Value) -> Value {
        let kind = match &schema["type"] {
            Value::Array(_) if self.below(4) == 0 => return Value::Null,
            Value::Array(kinds) => kinds[0].as_str().unwrap(),
            kind => kind.as_str().unwrap(),
        };
        match kind {
            "boolean" => json!(self.below(2) == 0),
            "number" => {
                let (least, most) = (schema["minimum"].as_f64().unwrap(), schema["maximum"].as_f64().unwrap());
                json!(match self.below(4) {
                    0 => least,
                    1 => most,
                    _ => least + (most - least) * (self.below(1000) as f64 / 1000.0),
                })
            }
            "string" => {
                self.drawn += 1;
                json!(format!("drawn {}", self.drawn))
            }
            "object" => {
                let required = schema["required"].as_array().cloned().unwrap_or_default();
                let mut object = serde_json::Map::new();
                for (name, property) in schema["properties"].as_object().into_iter().flatten() {
                    if required.contains(&json!(name)) || self.below(2) == 0 {
                        object.insert(name.clone(), self.value(property));
                    }
                }
                if schema["additionalProperties"].is_object() {
                    object.insert("more".to_owned(), self.value(&schema["additionalProperties"]));
                }
                Value::Object(object)
            }
            other => panic!("{other} is not drawn"),
        }
    }
}

#[tokio::test]
async fn devices_and_muscles_are_accepted_if_and_only_if_they_match_the_description() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let subject = service.subject().await;
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut drawn = Drawn { state: 1, drawn: 0 };
    let muscles = "/api/v1/subjects/{id}/muscles";
    for (method, path, component) in
        [("post", "/api/v1/devices", "DeviceDefinition"), ("put", muscles, "MuscleParameters")]
    {
        let schema = &document["components"]["schemas"][component];
        let address = path.replace("{id}", &subject.to_string());
        let send = async |body: &Value| match method {
            "put" => service.put(&address, body).await,
            _ => service.post(&address, body).await,
        };
        for _ in 0..100 {
            let body = drawn.value(schema);
            let answer = send(&body).await;
            assert!(answer.status.is_success(), "{path}: {body}: {}", answer.text);
        }
        // Every number beyond either end of its range is refused by name.
        let mut refused = 0;
        let groups = schema["properties"].as_object().unwrap().iter();
        let groups = groups.filter(|(_, property)| property["properties"].is_object());
        let places: Vec<(Option<&String>, &Value)> =
            groups.map(|(name, group)| (Some(name), group)).chain([(None, schema)]).collect();
        for (group, fields) in places {
            for (name, field) in fields["properties"].as_object().unwrap() {
                let (Some(least), Some(most)) = (field["minimum"].as_f64(), field["maximum"].as_f64()) else {
                    continue;
                };
                let width = most - least;
                for beyond in [least - 1e-6 * width, most + 1e-6 * width] {
                    let mut body = drawn.value(schema);
                    match group {
                        Some(group) => body[group] = json!({ name: beyond }),
                        None => body[name] = json!(beyond),
                    }
                    let answer = send(&body).await;
                    assert_eq!(answer.status, StatusCode::UNPROCESSABLE_ENTITY, "{path}: {body}: {}", answer.text);
                    assert!(answer.json()["field"].as_str().unwrap().ends_with(name.as_str()), "{}", answer.text);
                    refused += 1;
                }
            }
        }
        assert!(refused >= 40, "{path}: {refused}");
    }
    service.stop().await;
}
