//! Filters, order and pages of all lists of the REST interface, found in its description.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, StatusCode};
use gaitwright_http::openapi;
use gaitwright_store::studies::{Evaluation, StudyState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use std::collections::BTreeSet;

const UNKNOWN: &str = "01890000-0000-7000-8000-000000000000";

/// Every operation: method, path and description.
fn operations() -> Vec<(String, String, Value)> {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let paths = document["paths"].as_object().unwrap();
    let of_path = |(path, item): (&String, &Value)| -> Vec<_> {
        let operations = item.as_object().unwrap().iter();
        operations.map(|(method, operation)| (method.to_uppercase(), path.clone(), operation.clone())).collect()
    };
    paths.iter().flat_map(of_path).collect()
}

fn query_parameters(operation: &Value) -> Vec<&Value> {
    operation["parameters"].as_array().into_iter().flatten().filter(|parameter| parameter["in"] == "query").collect()
}

/// The operations that list something.
fn lists() -> Vec<(String, Value)> {
    let is_list = |operation: &Value| query_parameters(operation).iter().any(|parameter| parameter["name"] == "cursor");
    let all = operations().into_iter().filter(|(_, _, operation)| is_list(operation));
    all.map(|(_, path, operation)| (path, operation)).collect()
}

/// A service with a finished study, and addresses of objects for the paths of operations.
struct Scene {
    _folder: tempfile::TempDir,
    service: Service,
    ids: Vec<(&'static str, String)>,
}

impl Scene {
    async fn set() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
        let study = service.study(|new| new.number_of_trials = 4).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        let trials = service.trials(study).await;
        let (one, two) = (trials[0].id, trials[1].id);
        let gaits = json!({"trial_a": one, "trial_b": two});
        let session = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &gaits).await;
        let ids = vec![
            ("subjects", service.subject().await.to_string()),
            ("studies", study.to_string()),
            ("trials", one.to_string()),
            ("lab-sessions", session.json()["id"].as_str().unwrap().to_owned()),
        ];
        Self { _folder: folder, service, ids }
    }

    fn address(&self, path: &str) -> String {
        let of = path.split('/').nth(3).unwrap_or_default();
        let id = self.ids.iter().find(|(kind, _)| *kind == of).map_or(UNKNOWN, |(_, id)| id);
        path.replace("{id}", id)
            .replace("{code}", &"0".repeat(64))
            .replace("{side}", "first")
            .replace("{file}", "a.svg")
    }

    /// The parameters that a list needs.
    fn needed(&self, path: &str) -> String {
        let studies = || self.ids.iter().find(|(kind, _)| *kind == "studies").map_or(UNKNOWN, |(_, id)| id);
        if path.ends_with("/study-comparison") { format!("ids={},{UNKNOWN}&", studies()) } else { String::new() }
    }

    async fn send(&self, method: &str, address: &str) -> Answer {
        self.service.send(Request::builder().method(method).uri(address).body(Body::empty()).unwrap()).await
    }
}

/// A problem about a parameter, with its name and value.
fn is_about(answer: &Answer, status: StatusCode, kind: &str, (name, value): (&str, &str), what: &str) {
    assert_eq!(answer.status, status, "{what}: {}", answer.text);
    let problem = answer.json();
    let found = (&problem["type"], &problem["field"], &problem["value"]);
    assert_eq!(found, (&json!(kind), &json!(name), &json!(value)), "{what}: {}", answer.text);
}

#[tokio::test]
async fn every_operation_refuses_an_unknown_query_parameter() {
    let scene = Scene::set().await;
    let mut asked = 0;
    for (method, path, operation) in operations() {
        let address = format!("{}?{}unknown=1", scene.address(&path), scene.needed(&path));
        let refused = scene.send(&method, &address).await;
        let what = format!("{method} {path}");
        is_about(&refused, StatusCode::BAD_REQUEST, "/problems/malformed", ("unknown", "1"), &what);
        for known in query_parameters(&operation) {
            let name = known["name"].as_str().unwrap();
            assert!(refused.json()["detail"].as_str().unwrap().contains(name), "{what}: {}", refused.text);
        }
        if method == "GET" {
            assert_eq!(scene.send("HEAD", &address).await.status, StatusCode::BAD_REQUEST, "{what}");
        }
        asked += 1;
    }
    assert!(asked > 120, "{asked}");
    scene.service.stop().await;
}

#[tokio::test]
async fn wrong_value_of_a_parameter_is_refused_in_one_way_with_the_allowed_words() {
    let scene = Scene::set().await;
    let mut refused = BTreeSet::new();
    for (method, path, operation) in operations() {
        for parameter in query_parameters(&operation) {
            let (name, schema) = (parameter["name"].as_str().unwrap(), &parameter["schema"]);
            let words = words(schema);
            let is_any_text = schema["type"] == "string" && words.is_empty() && schema["format"].is_null();
            if is_any_text && schema["pattern"].is_null() {
                continue;
            }
            let needed = if name == "ids" { String::new() } else { scene.needed(&path) };
            let address = format!("{}?{needed}{name}=no+such+word", scene.address(&path));
            let what = format!("{method} {path} {name}");
            // Of some kinds, the scene has no object.
            let answer = scene.send(&method, &address).await;
            if answer.status == StatusCode::NOT_FOUND {
                continue;
            }
            is_about(
                &answer,
                StatusCode::UNPROCESSABLE_ENTITY,
                "/problems/invalid-field",
                (name, "no such word"),
                &what,
            );
            let allowed = answer.json()["allowed"].as_str().unwrap().to_owned();
            for word in words.iter().map(|word| word.trim_start_matches('-')) {
                assert!(allowed.contains(word), "{what} has {word}: {allowed}");
            }
            assert!(answer.json()["detail"].as_str().unwrap().contains(&allowed), "{what}: {}", answer.text);
            refused.insert(format!("{path} {name}"));
        }
    }
    assert!(refused.len() > 60 && refused.iter().any(|one| one.ends_with("trials sort")), "{refused:?}");
    scene.service.stop().await;
}

/// The words of an enumeration, which may be in a component.
fn words(schema: &Value) -> Vec<String> {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let parts = schema["oneOf"].as_array().cloned().unwrap_or_else(|| vec![schema.clone()]);
    let resolved = parts.iter().map(|part| match part["$ref"].as_str() {
        Some(name) => document.pointer(name.trim_start_matches('#')).unwrap().clone(),
        None => part.clone(),
    });
    let of_part = |part: Value| part["enum"].as_array().cloned().unwrap_or_default();
    resolved.flat_map(of_part).filter_map(|word| word.as_str().map(str::to_owned)).collect()
}

#[tokio::test]
async fn every_list_refuses_a_cursor_of_another_list_filter_or_order() {
    let scene = Scene::set().await;
    let foreign = scene.service.fetch("/api/v1/audit?limit=1").await.json()["next"].as_str().unwrap().to_owned();
    let other = |answer: &Answer, cursor: &str, what: &str| {
        let kind = "/problems/cursor-of-another-list";
        is_about(answer, StatusCode::UNPROCESSABLE_ENTITY, kind, ("cursor", cursor), what);
    };
    let mut asked = 0;
    for (path, _) in lists() {
        let address = scene.address(&path);
        if path == "/api/v1/audit" || address.contains(UNKNOWN) {
            continue;
        }
        let refused = scene.service.fetch(&format!("{address}?{}cursor={foreign}", scene.needed(&path))).await;
        other(&refused, &foreign, &path);
        asked += 1;
    }
    assert!(asked > 25, "{asked}");
    let filtered = scene.service.fetch(&format!("/api/v1/audit?text=study&cursor={foreign}")).await;
    other(&filtered, &foreign, "another filter");
    let trials = scene.address("/api/v1/studies/{id}/trials");
    let first = scene.service.fetch(&format!("{trials}?limit=1&sort=-gait_rmse_rad")).await.json();
    let next = first["next"].as_str().unwrap();
    other(&scene.service.fetch(&format!("{trials}?sort=gait_rmse_rad&cursor={next}")).await, next, "another order");
    let same = scene.service.fetch(&format!("{trials}?sort=-gait_rmse_rad&limit=3&cursor={next}")).await;
    assert_eq!(same.status, StatusCode::OK, "{}", same.text);
    scene.service.stop().await;
}

/// The numbers of the trials on the pages that follow each other, with something done between them.
async fn numbers(service: &Service, list: &str, limit: usize, between: impl AsyncFn(usize)) -> Vec<u64> {
    let (mut numbers, mut cursor, mut pages) = (Vec::new(), String::new(), 0);
    loop {
        let page = service.fetch(&format!("{list}limit={limit}{cursor}")).await;
        assert_eq!(page.status, StatusCode::OK, "{}", page.text);
        let page = page.json();
        numbers.extend(page["items"].as_array().unwrap().iter().map(|trial| trial["number"].as_u64().unwrap()));
        let Some(next) = page["next"].as_str() else { return numbers };
        cursor = format!("&cursor={next}");
        pages += 1;
        between(pages).await;
    }
}

#[tokio::test]
async fn trials_that_change_state_between_two_pages_hide_and_repeat_no_other_trial() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let plan = |study: &mut gaitwright_service::studies::study_plan::NewStudy| {
        (study.number_of_trials, study.parallel_trials, study.evaluation) = (8, 8, Evaluation::Script);
    };
    let study = service.study(plan).await;
    let mut open = Vec::new();
    for script in 0..8 {
        let asked =
            service.post(&format!("/api/v1/studies/{study}/ask"), &json!({"script": format!("s{script}")})).await;
        assert_eq!(asked.status, StatusCode::CREATED, "{}", asked.text);
        open.push(asked.json()["id"].as_str().unwrap().to_owned());
    }
    let state =
        service.fetch(&format!("/api/v1/trials/{}", open[0])).await.json()["state"].as_str().unwrap().to_owned();
    let tell = async |number: usize, rmse: f64| {
        let told = json!({"label": "converged", "gait_rmse_rad": rmse});
        let told = service.post(&format!("/api/v1/trials/{}/tell", open[number - 1]), &told).await;
        assert_eq!(told.status, StatusCode::OK, "{}", told.text);
    };
    let trials = format!("/api/v1/studies/{study}/trials?");
    // Trials 1 and 2 leave the list after the first page, which has them, and trial 4 before the second page.
    let open_ones = numbers(&service, &format!("{trials}state={state}&"), 2, async |pages| {
        if pages == 1 {
            tell(1, 0.5).await;
            tell(2, 0.4).await;
            tell(4, 0.3).await;
        }
    })
    .await;
    assert_eq!(open_ones, [1, 2, 3, 5, 6, 7, 8]);
    // Trial 6 comes to the list before the place that was reached, and trial 7 after it.
    let by_rmse = numbers(&service, &format!("{trials}state=converged&sort=gait_rmse_rad&"), 1, async |pages| {
        if pages == 1 {
            tell(6, 0.1).await;
            tell(7, 0.45).await;
        }
    })
    .await;
    assert_eq!(by_rmse, [4, 2, 7, 1]);
    // Trials without a value come last, in both orders.
    for (sort, expected) in [("gait_rmse_rad", [6, 4, 2, 7, 1, 8, 5, 3]), ("-gait_rmse_rad", [1, 7, 2, 4, 6, 8, 5, 3])]
    {
        for limit in [1, 2, 3, 8] {
            assert_eq!(numbers(&service, &format!("{trials}sort={sort}&"), limit, async |_| ()).await, expected);
        }
    }
    // A trial without the value is in no range of it.
    let (all, some) =
        (format!("{trials}range=gait_rmse_rad&"), format!("{trials}range=gait_rmse_rad&at_least=0.3&at_most=0.45&"));
    assert_eq!(numbers(&service, &all, 3, async |_| ()).await, [1, 2, 4, 6, 7]);
    assert_eq!(numbers(&service, &some, 1, async |_| ()).await, [2, 4, 7]);
    assert_eq!(numbers(&service, &format!("{some}sort=-gait_rmse_rad&"), 2, async |_| ()).await, [7, 2, 4]);
    let bound = service.trials(study).await[0].action.to_array()[0];
    let of_bound =
        numbers(&service, &format!("{trials}range=a1&at_least={bound}&at_most={bound}&"), 2, async |_| ()).await;
    assert!(of_bound.contains(&1), "{of_bound:?}");
    assert!(numbers(&service, &format!("{trials}range=a1&at_most=-1&"), 2, async |_| ()).await.is_empty());
    for wrong in ["at_least=1", "at_most=1", "range=number", "range=a1&at_least=NaN", "range=a1&at_most=x"] {
        let refused = service.fetch(&format!("{trials}{wrong}")).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{wrong}: {}", refused.text);
    }
    for sort in ["number", "-number", "state", "a1", "-a3", "iterations", "seconds_total"] {
        let whole = numbers(&service, &format!("{trials}sort={sort}&"), 1000, async |_| ()).await;
        assert_eq!(whole.iter().collect::<BTreeSet<_>>().len(), 8, "{sort}");
        for limit in [1, 3] {
            assert_eq!(numbers(&service, &format!("{trials}sort={sort}&"), limit, async |_| ()).await, whole, "{sort}");
        }
    }
    service.stop().await;
}
