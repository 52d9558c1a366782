//! The reference page of the REST interface, generated from its description, with a form for each operation.
//!
//! Ready-made viewers add megabytes of script and inline styles, which the content policy refuses. This page is
//! complete without scripts and loads nothing from other origins.

use crate::openapi;
use crate::page_error::{PageResult, page};
use askama::Template;
use gaitwright_service::error::Error;
use serde_json::Value;

#[derive(Template)]
#[template(path = "api.html")]
struct ReferencePage {
    groups: Vec<OperationGroup>,
    /// The changes that refuse an Idempotency-Key.
    without_key: Vec<String>,
}

/// The operations with one tag.
struct OperationGroup {
    name: String,
    meaning: String,
    operations: Vec<Operation>,
}

/// An operation: a method of a path.
struct Operation {
    method: String,
    path: String,
    summary: String,
    /// The right that it requires; empty if none.
    right: String,
    parameters: Vec<Parameter>,
    /// An example of the body; `None` if it takes none.
    body: Option<String>,
    answers: Vec<(String, String)>,
}

struct Parameter {
    name: String,
    place: String,
    required: bool,
    meaning: String,
}

/// `GET /api`.
pub(super) async fn get() -> PageResult {
    let document = openapi::value().map_err(|e| Error::Internal(e.to_string()))?;
    let groups = groups(&document);
    let operations = groups.iter().flat_map(|group| &group.operations);
    let without_key = operations.filter(|operation| operation.changes_without_key()).map(Operation::name).collect();
    page(&ReferencePage { groups, without_key })
}

impl Operation {
    fn name(&self) -> String {
        format!("{} {}", self.method, self.path)
    }

    fn changes_without_key(&self) -> bool {
        self.method != "GET" && !self.parameters.iter().any(|parameter| parameter.name == "Idempotency-Key")
    }
}

fn groups(document: &Value) -> Vec<OperationGroup> {
    let mut groups: Vec<OperationGroup> = Vec::new();
    for (path, item) in document["paths"].as_object().into_iter().flatten() {
        for (method, operation) in item.as_object().into_iter().flatten() {
            let name = operation["tags"][0].as_str().unwrap_or("other").to_owned();
            let described = described(document, path, method, operation);
            if let Some(group) = groups.iter_mut().find(|group| group.name == name) {
                group.operations.push(described);
            } else {
                let tag = document["tags"].as_array().into_iter().flatten().find(|tag| tag["name"] == name.as_str());
                let meaning = tag.and_then(|tag| tag["description"].as_str()).unwrap_or_default().to_owned();
                groups.push(OperationGroup { name, meaning, operations: vec![described] });
            }
        }
    }
    groups.sort_by(|a, b| a.name.cmp(&b.name));
    groups
}

fn described(document: &Value, path: &str, method: &str, operation: &Value) -> Operation {
    let text = |value: &Value| value.as_str().unwrap_or("").to_owned();
    let parameters = operation["parameters"].as_array().into_iter().flatten();
    let answers = operation["responses"].as_object().into_iter().flatten();
    let schema = &operation["requestBody"]["content"]["application/json"]["schema"];
    let example = || serde_json::to_string_pretty(&example(document, schema, 0)).unwrap_or_default();
    Operation {
        method: method.to_uppercase(),
        path: path.to_owned(),
        summary: without_address(&text(&operation["summary"])),
        right: text(&operation["security"][0]["token"][0]),
        parameters: parameters
            .map(|p| Parameter {
                name: text(&p["name"]),
                place: text(&p["in"]),
                required: p["required"].as_bool().unwrap_or(false),
                meaning: text(&p["description"]),
            })
            .collect(),
        body: schema.is_object().then(example),
        answers: answers.map(|(status, answer)| (status.clone(), text(&answer["description"]))).collect(),
    }
}

/// Without the `` `GET /me`: `` that a description begins with, which the page says already, and without marks of code.
fn without_address(summary: &str) -> String {
    let rest = summary.strip_prefix('`').and_then(|rest| rest.split_once('`')).map_or(summary, |(_, rest)| rest);
    rest.trim_start_matches([':', '.', ' ']).replace('`', "")
}

/// An example document of a schema, with the required fields only.
fn example(document: &Value, schema: &Value, depth: usize) -> Value {
    if depth > 6 {
        return Value::Null;
    }
    if let Some(name) = schema["$ref"].as_str().and_then(|r| r.rsplit('/').next()) {
        return example(document, &document["components"]["schemas"][name], depth + 1);
    }
    if let Some(first) = schema["enum"].get(0) {
        return first.clone();
    }
    match schema["type"].as_str() {
        Some("object") => {
            let required = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
            required
                .map(|name| (name.to_owned(), example(document, &schema["properties"][name], depth + 1)))
                .collect::<serde_json::Map<_, _>>()
                .into()
        }
        Some("array") => Value::Array(vec![example(document, &schema["items"], depth + 1)]),
        Some("integer" | "number") => schema.get("minimum").cloned().unwrap_or_else(|| 1.into()),
        Some("boolean") => Value::Bool(true),
        _ => Value::String(String::new()),
    }
}
