//! Compares served documents with their schemas in the description of the REST interface.

use crate::service::Service;
use gaitwright_http::openapi;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};

const COMPONENTS: &str = "#/components/schemas/";

/// The description, and the parts of it that were found in documents.
pub struct Description {
    document: Value,
    /// Components, and properties as `Component.property` or `Component.property.property`.
    pub seen: BTreeSet<String>,
}

impl Description {
    /// The description of this version.
    pub fn read() -> Self {
        Self { document: serde_json::from_str(&openapi::text().unwrap()).unwrap(), seen: BTreeSet::new() }
    }

    /// A component.
    pub fn component(&self, name: &str) -> &Value {
        let component = &self.document["components"]["schemas"][name];
        assert!(component.is_object(), "{name} is not described");
        component
    }

    /// Checks a response to a `GET` against its schema.
    pub fn hold(&mut self, path: &str, answer: &Value) {
        let pointer = format!("/paths/{}/get/responses/200/content/application~1json/schema", path.replace('/', "~1"));
        let schema = self.document.pointer(&pointer).unwrap_or_else(|| panic!("{path} is not described"));
        let seen = self.fits(schema, answer, "").unwrap_or_else(|wrong| panic!("{path}: {wrong}"));
        self.seen.extend(seen);
    }

    /// Checks a value against a named schema.
    pub fn hold_named(&mut self, name: &str, value: &Value) {
        let schema = json!({ "$ref": format!("{COMPONENTS}{name}") });
        let seen = self.fits(&schema, value, "").unwrap_or_else(|wrong| panic!("{name}: {wrong}"));
        self.seen.extend(seen);
    }

    /// The properties of a component, at any depth, that no document had.
    pub fn unseen(&self, component: &str) -> BTreeSet<String> {
        let mut all = BTreeSet::new();
        self.collect(self.component(component), component, &mut all);
        all.difference(&self.seen).cloned().collect()
    }

    fn collect(&self, schema: &Value, place: &str, all: &mut BTreeSet<String>) {
        if let Some(name) = schema["$ref"].as_str().and_then(|path| path.strip_prefix(COMPONENTS)) {
            return self.collect(self.component(name), name, all);
        }
        for (name, property) in schema["properties"].as_object().into_iter().flatten() {
            let inside = format!("{place}.{name}");
            self.collect(property, &inside, all);
            all.insert(inside);
        }
        for part in schema["oneOf"].as_array().into_iter().flatten().chain(schema.get("items")) {
            self.collect(part, place, all);
        }
    }

    /// Checks names and presence of every property, and types, words, ranges and numbers of values. Returns the parts of
    /// the description that the value has, or what is wrong.
    fn fits(&self, schema: &Value, value: &Value, place: &str) -> Result<BTreeSet<String>, String> {
        if let Some(name) = schema["$ref"].as_str().and_then(|path| path.strip_prefix(COMPONENTS)) {
            let mut seen = self.fits(self.component(name), value, name)?;
            seen.insert(name.to_owned());
            return Ok(seen);
        }
        if let Some(parts) = schema["oneOf"].as_array() {
            let (fitting, wrong): (Vec<_>, Vec<_>) =
                parts.iter().map(|part| self.fits(part, value, place)).partition(Result::is_ok);
            let wrong: Vec<String> = wrong.into_iter().filter_map(Result::err).collect();
            let [Ok(one)] = &fitting[..] else {
                return Err(format!("{place} fits {} of {} shapes: {wrong:?}", fitting.len(), parts.len()));
            };
            return Ok(one.clone());
        }
        fits_itself(schema, value, place)?;
        let mut seen = BTreeSet::new();
        for (index, item) in value.as_array().into_iter().flatten().enumerate() {
            seen.extend(self.fits(&schema["items"], item, place).map_err(|wrong| format!("[{index}] {wrong}"))?);
        }
        let (properties, required) = self.shape(schema, place, &mut seen);
        let none = Map::new();
        let object = value.as_object().unwrap_or(&none);
        for (name, value) in object {
            match (properties.get(name), &schema["additionalProperties"]) {
                (Some((inside, property)), _) => {
                    seen.extend(self.fits(property, value, inside)?);
                    seen.insert(inside.clone());
                }
                (None, rest @ Value::Object(_)) => seen.extend(self.fits(rest, value, place)?),
                (None, _) => return Err(format!("{place} has {name}, which is not described")),
            }
        }
        match required.iter().find(|name| value.is_object() && !object.contains_key(*name)) {
            Some(name) => Err(format!("{place} has no {name}")),
            None => Ok(seen),
        }
    }

    /// Every property of an object with its place and schema, and those that must be there, parts included.
    fn shape(
        &self,
        schema: &Value,
        place: &str,
        seen: &mut BTreeSet<String>,
    ) -> (BTreeMap<String, (String, Value)>, Vec<String>) {
        if let Some(name) = schema["$ref"].as_str().and_then(|path| path.strip_prefix(COMPONENTS)) {
            seen.insert(name.to_owned());
            return self.shape(self.component(name), name, seen);
        }
        let own = schema["properties"].as_object().into_iter().flatten();
        let mut properties: BTreeMap<_, _> =
            own.map(|(name, schema)| (name.clone(), (format!("{place}.{name}"), schema.clone()))).collect();
        let names = schema["required"].as_array().into_iter().flatten();
        let mut required: Vec<String> = names.map(|name| name.as_str().unwrap().to_owned()).collect();
        for part in schema["allOf"].as_array().into_iter().flatten() {
            let (more, needed) = self.shape(part, place, seen);
            properties.extend(more);
            required.extend(needed);
        }
        // One of several schemas, chosen by the value. The description has the names of all of them.
        for alternative in schema["oneOf"].as_array().into_iter().flatten() {
            properties.extend(self.shape(alternative, place, seen).0);
        }
        (properties, required)
    }
}

/// Type, words, range and number of items of a value.
fn fits_itself(schema: &Value, value: &Value, place: &str) -> Result<(), String> {
    let kinds: Vec<&str> = match &schema["type"] {
        Value::String(kind) => vec![kind],
        Value::Array(kinds) => kinds.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    };
    let kind = match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    };
    let fits = |expected: &&str| *expected == kind || (*expected == "number" && kind == "integer");
    if !kinds.is_empty() && !kinds.iter().any(fits) {
        return Err(format!("{place}: {value} is not {kinds:?}"));
    }
    if schema["enum"].as_array().is_some_and(|words| !value.is_null() && !words.contains(value)) {
        return Err(format!("{place}: {value} is not one of {}", schema["enum"]));
    }
    let size = value.as_array().map(|items| items.len() as f64);
    for (measured, least, most) in [(value.as_f64(), "minimum", "maximum"), (size, "minItems", "maxItems")] {
        let Some(measured) = measured else { continue };
        let end = |name: &str, none: f64| schema[name].as_f64().unwrap_or(none);
        if measured < end(least, f64::NEG_INFINITY) || measured > end(most, f64::INFINITY) {
            return Err(format!("{place}: {measured} is outside {least} or {most}"));
        }
    }
    Ok(())
}

/// Checks every row of the audit trail. Returns the details that at least one of them has.
pub async fn audit_trail(service: &Service) -> BTreeSet<String> {
    let mut description = Description::read();
    let mut cursor = String::new();
    loop {
        let page = service.fetch(&format!("/api/v1/audit?limit=1000{cursor}")).await.json();
        description.hold("/api/v1/audit", &page);
        let Some(next) = page["next"].as_str() else { break };
        cursor = format!("&cursor={next}");
    }
    let details = description.seen.iter().filter_map(|place| place.strip_prefix("AuditDetail."));
    details.map(str::to_owned).collect()
}
