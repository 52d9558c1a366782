//! The guide for lab scripts: its addresses are described, and the service accepts its bodies.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright_http::openapi;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::page_routes;
use gaitwright_tests::service::Service;
use serde_json::Value;
use std::collections::BTreeMap;

const GUIDE: &str = include_str!("../../docs/lab-script.md");

/// Addresses that are neither operations nor pages, and a folder.
const OTHER: [&str; 3] = ["/health", "/api/openapi.json", "/usr/share/doc/gaitwright/examples"];

/// An address in the guide.
#[derive(Debug, Clone, PartialEq)]
struct Request {
    /// In lower case; `None` where the guide names an address only.
    method: Option<String>,
    /// Without `/api/v1`, with placeholders in capitals.
    path: String,
    /// Names of the parameters.
    query: Vec<String>,
    body: Option<String>,
    /// Whether the guide sends it with its command `gait`.
    is_command: bool,
}

impl Request {
    fn of(method: Option<String>, address: &str) -> Self {
        let (path, query) = address.split_once('?').unwrap_or((address, ""));
        let names = query.split('&').filter_map(|pair| Some(pair.split_once('=')?.0.to_owned()));
        let path = path.strip_prefix("/api/v1").unwrap_or(path).to_owned();
        Self { method, path, query: names.collect(), body: None, is_command: false }
    }

    /// `gait '/studies?limit=20'`, or `gait /studies -d '{...}'`.
    fn of_command(line: &str) -> Option<Self> {
        let command = line.strip_prefix("gait ")?.split("  #").next()?.trim();
        let (address, rest) = command.split_once(' ').unwrap_or((command, ""));
        let body = rest.strip_prefix("-d '").map(|body| body.trim_end_matches('\'').to_owned());
        let method = if body.is_some() { "post" } else { "get" };
        Some(Self { body, is_command: true, ..Self::of(Some(method.to_owned()), address.trim_matches('\'')) })
    }

    /// `POST /studies/STUDY/assessments`, or `/api`.
    fn of_span(span: &str) -> Option<Self> {
        let words: Vec<&str> = span.split_whitespace().collect();
        match words[..] {
            [address] if address.starts_with('/') => Some(Self::of(None, address)),
            [method, address] if address.starts_with('/') => Some(Self::of(Some(method.to_lowercase()), address)),
            _ => None,
        }
    }
}

/// The requests of a guide in the order of its text. A span with an object is the body of the `POST` before it.
fn requests(guide: &str) -> Vec<Request> {
    let mut all: Vec<Request> = Vec::new();
    for (index, part) in guide.split("```").enumerate() {
        if index % 2 == 1 {
            let Some(part) = part.strip_prefix("sh\n") else { continue };
            all.extend(part.lines().filter_map(Request::of_command));
            let curl =
                part.lines().filter(|line| line.starts_with("curl ")).filter_map(|line| line.split_once(":8080"));
            all.extend(curl.map(|(_, address)| Request::of(Some("get".to_owned()), address.trim())));
            continue;
        }
        for span in part.split('`').skip(1).step_by(2) {
            if let Some(request) = Request::of_span(span) {
                all.push(request);
            } else if span.starts_with('{') {
                let request =
                    all.last_mut().filter(|last| last.method.as_deref() == Some("post") && last.body.is_none());
                request.unwrap_or_else(|| panic!("no POST before {span}")).body = Some(span.to_owned());
            }
        }
    }
    all
}

/// A path with every placeholder replaced: `/jobs/solve-TRIAL` and `/jobs/{id}` are `/jobs/{}`.
fn template(path: &str) -> String {
    let part = |part: &str| {
        let is_placeholder = part.starts_with('{') || part.contains(|c: char| c.is_ascii_uppercase());
        if is_placeholder { "{}".to_owned() } else { part.to_owned() }
    };
    path.split('/').map(part).collect::<Vec<_>>().join("/")
}

/// The operations by method and path, each with the names of its parameters.
fn operations() -> BTreeMap<(String, String), Vec<String>> {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut all = BTreeMap::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            let parameters = operation["parameters"].as_array().into_iter().flatten();
            let names = parameters.map(|parameter| parameter["name"].as_str().unwrap().to_owned()).collect();
            all.insert((method.clone(), template(path.trim_start_matches("/api/v1"))), names);
        }
    }
    all
}

/// Fault of a request of the guide, if any.
fn fault(request: &Request, operations: &BTreeMap<(String, String), Vec<String>>) -> Option<String> {
    let path = template(&request.path);
    let has_method = |method: &str| request.method.as_deref().is_none_or(|asked| asked == method);
    let mut described = operations.iter().filter(|((method, known), _)| *known == path && has_method(method));
    if let Some((_, parameters)) = described.next() {
        let unknown = request.query.iter().find(|name| !parameters.contains(name));
        return unknown.map(|name| format!("{path} has no parameter {name}"));
    }
    let is_page = page_routes::all()
        .into_iter()
        .any(|(method, known)| template(&known) == path && has_method(&method.as_str().to_lowercase()));
    let is_elsewhere = !request.is_command && (is_page || OTHER.contains(&request.path.as_str()));
    (!is_elsewhere).then(|| format!("{:?} {path} is not described", request.method))
}

#[test]
fn every_address_and_parameter_of_the_guide_is_described() {
    let operations = operations();
    let requests = requests(GUIDE);
    assert!(requests.len() > 30, "{requests:#?}");
    let faults: Vec<String> = requests.iter().filter_map(|request| fault(request, &operations)).collect();
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn unknown_addresses_parameters_and_methods_are_found() {
    let operations = operations();
    let fault_of = |guide: &str| fault(&requests(guide)[0], &operations);
    for wrong in [
        "```sh\ngait /subject\n```",
        "```sh\ngait /system\n```",
        "```sh\ngait '/studies?states=running'\n```",
        "```sh\ngait /jobs -d '{}'\n```",
        "```sh\ncurl -s localhost:8080/healthy\n```",
        "`POST\n/preferences/PREFERENCE/retracted`",
        "`PUT /jobs/solve-TRIAL`",
        "`/unknown`",
    ] {
        assert!(fault_of(wrong).is_some(), "{wrong}");
    }
    for right in ["```sh\ngait '/studies?state=running'  # all\n```", "`/api`", "`GET /jobs/solve-TRIAL`"] {
        assert_eq!(fault_of(right), None, "{right}");
    }
}

/// Conflicts with the state of the study are no faults of a body. This service does not simulate walks, and a trial with a
/// gait has no explanation to cancel.
#[tokio::test]
async fn every_body_of_the_guide_is_accepted() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (10, AnswerSource::Both)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let converged: Vec<_> =
        service.trials(study).await.into_iter().filter(|trial| trial.state == TrialState::Converged).collect();
    let mut ids = BTreeMap::from([
        ("SUBJECT", service.subject().await.to_string()),
        ("STUDY", study.to_string()),
        ("PREFERENCE", String::new()),
        ("REPORT", String::new()),
    ]);
    let (mut script_study, mut script_trial) = (String::new(), String::new());
    let (mut sent, mut taken) = (0, 0);
    for request in requests(GUIDE) {
        let Some(body) = &request.body else { continue };
        let (mut path, mut body) = (format!("/api/v1{}", request.path), body.clone());
        let (of_study, of_trial) = if path.ends_with("/ask") || path.ends_with("/tell") {
            (script_study.clone(), script_trial.clone())
        } else {
            (ids["STUDY"].clone(), converged[0].id.to_string())
        };
        path = path.replace("STUDY", &of_study).replace("TRIAL", &of_trial).replace("PREFERENCE", &ids["PREFERENCE"]);
        body = body.replacen("TRIAL", &of_trial, 1).replace("TRIAL", &converged[1].id.to_string());
        for (name, id) in &ids {
            body = body.replace(&format!("\"{name}\""), &format!("\"{id}\""));
        }
        let body: Value = serde_json::from_str(&body).unwrap_or_else(|error| panic!("{body}: {error}"));
        let answer = service.post(&path, &body).await;
        let is_valid = [StatusCode::CONFLICT, StatusCode::SERVICE_UNAVAILABLE].contains(&answer.status)
            || answer.status == StatusCode::NOT_FOUND && path.starts_with("/api/v1/jobs/");
        assert!(answer.status.is_success() || is_valid, "{path} {body}: {}", answer.text);
        sent += 1;
        taken += usize::from(answer.status.is_success());
        if !answer.status.is_success() {
            continue;
        }
        let id = answer.json()["id"].as_str().unwrap_or_default().to_owned();
        match request.path.rsplit('/').next().unwrap() {
            "preferences" => drop(ids.insert("PREFERENCE", id)),
            "safety-reports" => drop(ids.insert("REPORT", id)),
            "studies" if body["evaluation"] == "script" => script_study = id,
            "ask" => script_trial = id,
            _ => {}
        }
    }
    assert!(sent > 12 && taken > 8, "{taken} of {sent} took effect");
    service.stop().await;
}
