//! The schemas of the description, to which rules are added. A rule whose component or field does not exist, for
//! example after a renaming, is collected, and a test fails with its name.

use serde_json::{Map, Value, json};

/// All schemas by name.
#[derive(Debug)]
pub(super) struct Schemas<'a> {
    all: &'a mut Map<String, Value>,
    /// The rules that found no component or field.
    pub(super) missed: Vec<String>,
}

impl<'a> Schemas<'a> {
    pub(super) fn of(all: &'a mut Map<String, Value>) -> Self {
        Self { all, missed: Vec::new() }
    }

    /// Adds a component.
    pub(super) fn insert(&mut self, component: &str, schema: Value) {
        self.all.insert(component.to_owned(), schema);
    }

    /// A component.
    pub(super) fn component(&mut self, name: &str) -> Option<&mut Map<String, Value>> {
        let found = self.all.get_mut(name).and_then(Value::as_object_mut);
        if found.is_none() {
            self.missed.push(name.to_owned());
        }
        found
    }

    /// A field of a component, with a slash between levels.
    pub(super) fn field(&mut self, component: &str, field: &str) -> Option<&mut Map<String, Value>> {
        let place = format!("/properties/{}", field.replace('/', "/properties/"));
        let found = self.all.get_mut(component).and_then(|schema| schema.pointer_mut(&place)?.as_object_mut());
        if found.is_none() {
            self.missed.push(format!("{component}.{field}"));
        }
        found
    }

    /// Adds rules to a field.
    pub(super) fn add(&mut self, component: &str, field: &str, rule: &Value) {
        if let Some(schema) = self.field(component, field) {
            merge(schema, rule);
        }
    }

    /// Replaces the schema of a field, and keeps its description.
    pub(super) fn set(&mut self, component: &str, field: &str, mut schema: Value) {
        let Some(present) = self.field(component, field) else { return };
        let nested = present.get("oneOf").and_then(|parts| parts.get(0)).and_then(|part| part.get("description"));
        if let (Some(text), Some(new)) = (present.get("description").or(nested), schema.as_object_mut()) {
            new.insert("description".to_owned(), text.clone());
        }
        if let Value::Object(schema) = schema {
            *present = schema;
        }
    }

    /// States that a component has no other fields.
    pub(super) fn close(&mut self, component: &str) {
        if let Some(schema) = self.component(component) {
            schema.insert("additionalProperties".to_owned(), json!(false));
        }
    }

    /// Replaces the schema of a component, and keeps its description.
    pub(super) fn put(&mut self, component: &str, mut schema: Value) {
        let Some(present) = self.component(component) else { return };
        if let (Some(text), Some(new)) = (present.get("description"), schema.as_object_mut()) {
            new.insert("description".to_owned(), text.clone());
        }
        if let Value::Object(schema) = schema {
            *present = schema;
        }
    }
}

/// Adds rules to a schema.
pub(super) fn merge(schema: &mut Map<String, Value>, rule: &Value) {
    for (name, value) in rule.as_object().into_iter().flatten() {
        schema.insert(name.clone(), value.clone());
    }
}
