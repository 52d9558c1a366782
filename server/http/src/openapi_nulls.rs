//! Requires the fields of responses that can be null: the service writes them, with null, where there is no value.

use super::openapi_rules::SCHEMAS;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// The schema whose fields depend on the entry: it has those of the change that it describes, and no others.
const FIELDS_OF_THE_ENTRY: &str = "AuditDetail";

/// Adds every field that can be null to the required fields of its schema, unless requests have that schema.
pub(super) fn require_in_responses(document: &mut Value) {
    let sent = in_requests(document);
    for (name, schema) in document["components"]["schemas"].as_object_mut().into_iter().flatten() {
        if sent.contains(name) || name == FIELDS_OF_THE_ENTRY {
            continue;
        }
        let fields = schema["properties"].as_object().into_iter().flatten();
        let nullable: Vec<Value> =
            fields.filter(|(_, field)| can_be_null(field)).map(|(field, _)| json!(field)).collect();
        if nullable.is_empty() {
            continue;
        }
        let mut required = schema["required"].as_array().cloned().unwrap_or_default();
        required.extend(
            nullable
                .into_iter()
                .filter(|field| !schema["required"].as_array().into_iter().flatten().any(|known| known == field)),
        );
        schema["required"] = json!(required);
    }
}

/// Whether a schema accepts null.
fn can_be_null(schema: &Value) -> bool {
    let alternatives = schema["oneOf"].as_array().into_iter().flatten();
    schema["type"].as_array().is_some_and(|types| types.contains(&json!("null")))
        || alternatives.into_iter().any(|alternative| alternative["type"] == "null")
}

/// Names of the schemas that bodies of requests have, directly or in a field.
fn in_requests(document: &Value) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for operation in
        document["paths"].as_object().into_iter().flatten().filter_map(|(_, item)| item.as_object()).flatten()
    {
        collect(&operation.1["requestBody"], &document["components"]["schemas"], &mut found);
    }
    found
}

/// Adds the names of the schemas that a value refers to.
fn collect(value: &Value, schemas: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(fields) => {
            let name = fields.get("$ref").and_then(Value::as_str).and_then(|path| path.strip_prefix(SCHEMAS));
            if let Some(name) = name
                && found.insert(name.to_owned())
            {
                collect(&schemas[name], schemas, found);
            }
            fields.values().for_each(|field| collect(field, schemas, found));
        }
        Value::Array(items) => items.iter().for_each(|item| collect(item, schemas, found)),
        _ => {}
    }
}
