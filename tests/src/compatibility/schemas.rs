//! Compares the schemas of values that clients send or receive.

use super::difference::Difference;
use super::shapes;
use serde_json::{Map, Value};
use std::collections::{BTreeMap, BTreeSet};

/// The direction of a value. Accepted requests must stay accepted, and responses must stay readable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Side {
    Request,
    Response,
}

/// A comparison of two descriptions.
pub(super) struct Schemas<'a> {
    old: &'a Value,
    new: &'a Value,
    pub(super) difference: Difference,
    /// Pairs of named schemas that were compared.
    seen: BTreeSet<(String, String, Side)>,
}

impl<'a> Schemas<'a> {
    pub(super) fn new(old: &'a Value, new: &'a Value) -> Self {
        Self { old, new, difference: Difference::default(), seen: BTreeSet::new() }
    }

    pub(super) fn schema(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        if old == new && !has_reference(old) {
            return;
        }
        let (name, old) = resolved(self.old, old);
        let (present_name, new) = resolved(self.new, new);
        if let (Some(name), Some(present)) = (name, present_name)
            && !self.seen.insert((name, present, side))
        {
            return;
        }
        self.default(place, &old, &new);
        match (shapes::has_choice(&old), shapes::has_choice(&new)) {
            (false, false) => self.value(place, &old, &new, side),
            (true, true) => {
                self.value(place, &old, &new, side);
                self.choice(place, &old, &new, side);
            }
            _ => self.choice(place, &old, &new, side),
        }
    }

    fn value(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        self.types(place, old, new, side);
        self.words(place, old, new, side);
        if side == Side::Request {
            self.rules(place, old, new);
        }
        self.properties(place, old, new, side);
        if old["items"].is_object() || new["items"].is_object() {
            self.schema(&format!("{place}[]"), &old["items"], &new["items"], side);
        }
        let parts = |schema: &Value| schema["allOf"].as_array().cloned().unwrap_or_default();
        let (before, after) = (parts(old), parts(new));
        if before.len() == after.len() {
            for (old, new) in before.iter().zip(&after) {
                self.schema(place, old, new, side);
            }
        } else {
            self.difference.breaks(place, format_args!("it has {} parts instead of {}", after.len(), before.len()));
        }
    }

    /// An absent value has the default, so a request without it gets another meaning.
    fn default(&mut self, place: &str, old: &Value, new: &Value) {
        let shown = |default: Option<&Value>| default.map_or("absent".to_owned(), Value::to_string);
        let (before, after) = (old.get("default"), new.get("default"));
        if before != after {
            let change = format!("its default is {} instead of {}", shown(after), shown(before));
            self.difference.note(before.is_some(), place, change);
        }
    }

    /// Alternatives of which a value has one. Either side may have a single one.
    fn choice(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        let shapes::Matched { pairs, gone, added } = shapes::matched(old, new);
        for (old, new) in pairs {
            self.schema(place, &old, &new, side);
        }
        for shape in gone {
            self.difference.note(side == Side::Request, place, format_args!("the shape {shape} is gone"));
        }
        for shape in added {
            self.difference.note(side == Side::Response, place, format_args!("the new shape {shape}"));
        }
    }

    fn types(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        let (before, after) = (types(old), types(new));
        if old["format"] != new["format"] {
            let change = format!("its format is {} instead of {}", new["format"], old["format"]);
            self.difference.breaks(place, change);
        }
        if before == after {
            return;
        }
        let (accepted, given) = match side {
            Side::Request => (&after, &before),
            Side::Response => (&before, &after),
        };
        let fits = accepted.is_empty()
            || !given.is_empty()
                && given
                    .iter()
                    .all(|kind| accepted.contains(kind) || *kind == "integer" && accepted.contains("number"));
        self.difference.note(!fits, place, format_args!("its type is {after:?} instead of {before:?}"));
    }

    /// Generated clients refuse a word in a response that they do not know.
    fn words(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        match (words(old), words(new)) {
            (Some(before), Some(after)) => {
                for word in before.difference(&after) {
                    self.difference.note(side == Side::Request, place, format_args!("{word} is gone"));
                }
                for word in after.difference(&before) {
                    self.difference.note(side == Side::Response, place, format_args!("the new word {word}"));
                }
            }
            (None, Some(_)) => self.difference.note(side == Side::Request, place, "it is one of certain words"),
            (Some(_), None) => self.difference.note(side == Side::Response, place, "it is any text"),
            (None, None) => {}
        }
    }

    /// Ranges, lengths, patterns and conditions of values that clients send.
    fn rules(&mut self, place: &str, old: &Value, new: &Value) {
        let lower = ["minimum", "exclusiveMinimum", "minLength", "minItems", "minProperties"].map(|rule| (rule, 1.0));
        let upper = ["maximum", "exclusiveMaximum", "maxLength", "maxItems", "maxProperties"].map(|rule| (rule, -1.0));
        for (rule, sign) in lower.into_iter().chain(upper) {
            let limit = |schema: &Value| schema[rule].as_f64().map_or(f64::NEG_INFINITY, |limit| sign * limit);
            if limit(new) != limit(old) {
                let change = format!("{rule} is {} instead of {}", new[rule], old[rule]);
                self.difference.note(limit(new) > limit(old), place, change);
            }
        }
        for rule in ["pattern", "uniqueItems", "if", "then", "else"] {
            if old[rule] != new[rule] {
                let is_lifted = new[rule].is_null() || new[rule] == false;
                let change = format!("{rule} is {} instead of {}", new[rule], old[rule]);
                self.difference.note(!is_lifted, place, change);
            }
        }
    }

    fn properties(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        let fields =
            |schema: &Value| -> Map<String, Value> { schema["properties"].as_object().cloned().unwrap_or_default() };
        let required = |schema: &Value, name: &str| {
            schema["required"].as_array().is_some_and(|names| names.iter().any(|one| one == name))
        };
        let (before, after) = (fields(old), fields(new));
        for (name, field) in &before {
            let inside = format!("{place}.{name}");
            let Some(present) = after.get(name) else {
                self.difference.breaks(&inside, "the field is gone");
                continue;
            };
            match (required(old, name), required(new, name)) {
                (false, true) => self.difference.note(side == Side::Request, &inside, "the field is required"),
                (true, false) => self.difference.note(side == Side::Response, &inside, "the field may be missing"),
                _ => {}
            }
            self.schema(&inside, field, present, side);
        }
        for name in after.keys().filter(|name| !before.contains_key(*name)) {
            if side == Side::Request && required(new, name) {
                self.difference.breaks(place, format_args!("the new field {name} is required"));
            } else {
                self.difference.adds(place, format_args!("the new field {name}"));
            }
        }
        let (open, closed) = (&old["additionalProperties"], &new["additionalProperties"]);
        if closed == false && open != false && side == Side::Request && old["type"] == "object" {
            self.difference.breaks(place, "other fields are refused");
        }
        if open.is_object() && closed.is_object() {
            self.schema(&format!("{place}{{}}"), open, closed, side);
        }
        // The names of fields are texts, whether the schema says so or not.
        let names = |schema: &Value| {
            schema.get("propertyNames").cloned().unwrap_or_else(|| serde_json::json!({ "type": "string" }))
        };
        self.schema(&format!("{place} names"), &names(old), &names(new), side);
    }
}

fn has_reference(schema: &Value) -> bool {
    match schema {
        Value::Object(fields) => fields.contains_key("$ref") || fields.values().any(has_reference),
        Value::Array(parts) => parts.iter().any(has_reference),
        _ => false,
    }
}

/// The schema that a reference leads to with the keywords beside the reference, and what identifies it.
fn resolved(document: &Value, schema: &Value) -> (Option<String>, Value) {
    let Some(reference) = schema["$ref"].as_str() else { return (None, schema.clone()) };
    let mut found = document.pointer(reference.trim_start_matches('#')).cloned().unwrap_or_default();
    let beside =
        schema.as_object().into_iter().flatten().filter(|(name, _)| !["$ref", "description"].contains(&name.as_str()));
    let beside: BTreeMap<_, _> = beside.map(|(name, value)| (name.clone(), value.clone())).collect();
    let name = format!("{reference} {beside:?}");
    if let Some(found) = found.as_object_mut() {
        found.extend(beside);
    }
    (Some(name), found)
}

fn types(schema: &Value) -> BTreeSet<&str> {
    match &schema["type"] {
        Value::String(kind) => BTreeSet::from([kind.as_str()]),
        Value::Array(kinds) => kinds.iter().filter_map(Value::as_str).collect(),
        _ => BTreeSet::new(),
    }
}

fn words(schema: &Value) -> Option<BTreeSet<String>> {
    Some(schema["enum"].as_array()?.iter().map(Value::to_string).collect())
}
