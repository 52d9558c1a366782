//! Compares two descriptions of the REST interface: which changes break clients, and which are additions.

use serde_json::{Map, Value};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;

/// How two descriptions differ.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Difference {
    /// Changes that break clients of the old description.
    pub breaks: Vec<String>,
    /// What it need not know.
    pub additions: Vec<String>,
}

/// The direction of a value. Accepted requests must stay accepted, and responses must stay readable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Side {
    Request,
    Answer,
}

/// Compares the description that clients know with a new one.
pub fn compare(old: &Value, new: &Value) -> Difference {
    let mut comparison = Comparison { old, new, difference: Difference::default(), seen: BTreeSet::new() };
    let (before, after) = (operations(old), operations(new));
    for (what, operation) in &before {
        match after.get(what) {
            Some(present) => comparison.operation(what, operation, present),
            None => comparison.breaks(what, "the operation is gone"),
        }
    }
    for what in after.keys().filter(|what| !before.contains_key(*what)) {
        comparison.adds(what, "a new operation");
    }
    comparison.difference
}

fn operations(document: &Value) -> BTreeMap<String, &Value> {
    let mut all = BTreeMap::new();
    for (path, item) in document["paths"].as_object().into_iter().flatten() {
        for (method, operation) in item.as_object().into_iter().flatten() {
            all.insert(format!("{method} {path}"), operation);
        }
    }
    all
}

struct Comparison<'a> {
    old: &'a Value,
    new: &'a Value,
    difference: Difference,
    /// Pairs of named schemas that were compared.
    seen: BTreeSet<(String, String, Side)>,
}

impl Comparison<'_> {
    fn breaks(&mut self, place: &str, what: impl Display) {
        self.difference.breaks.push(format!("{place}: {what}"));
    }

    fn adds(&mut self, place: &str, what: impl Display) {
        self.difference.additions.push(format!("{place}: {what}"));
    }

    fn operation(&mut self, what: &str, old: &Value, new: &Value) {
        for (name, meaning) in [("operationId", "its name"), ("security", "the right that it needs")] {
            if old[name] != new[name] {
                self.breaks(what, format_args!("{meaning} is {} instead of {}", new[name], old[name]));
            }
        }
        self.parameters(what, old, new);
        self.body(what, &old["requestBody"], &new["requestBody"]);
        let successes = |operation: &Value| -> BTreeMap<String, Value> {
            let responses = operation["responses"].as_object().cloned().unwrap_or_default();
            responses.into_iter().filter(|(status, _)| status.starts_with('2')).collect()
        };
        let (before, after) = (successes(old), successes(new));
        for status in after.keys().filter(|status| !before.contains_key(*status)) {
            self.breaks(what, format_args!("it may be answered with {status}"));
        }
        for (status, answer) in &before {
            match after.get(status) {
                Some(present) => self.content(&format!("{what} {status}"), answer, present, Side::Answer),
                None => self.breaks(what, format_args!("it is no longer answered with {status}")),
            }
        }
    }

    fn parameters(&mut self, what: &str, old: &Value, new: &Value) {
        let by_name = |operation: &Value| -> BTreeMap<String, Value> {
            let parameters = operation["parameters"].as_array().cloned().unwrap_or_default();
            parameters.into_iter().map(|one| (format!("{} {}", text(&one["in"]), text(&one["name"])), one)).collect()
        };
        let (before, after) = (by_name(old), by_name(new));
        for (name, parameter) in &before {
            let place = format!("{what} {name}");
            let Some(present) = after.get(name) else {
                self.breaks(&place, "the parameter is gone");
                continue;
            };
            if parameter["required"] != true && present["required"] == true {
                self.breaks(&place, "the parameter is required");
            }
            self.schema(&place, &parameter["schema"], &present["schema"], Side::Request);
        }
        for (name, parameter) in after.iter().filter(|(name, _)| !before.contains_key(*name)) {
            if parameter["required"] == true {
                self.breaks(what, format_args!("the new parameter {name} is required"));
            } else {
                self.adds(what, format_args!("the new parameter {name}"));
            }
        }
    }

    fn body(&mut self, what: &str, old: &Value, new: &Value) {
        let place = format!("{what} body");
        match (old.is_object(), new.is_object()) {
            (true, true) => {
                if old["required"] != true && new["required"] == true {
                    self.breaks(&place, "it is required");
                }
                self.content(&place, old, new, Side::Request);
            }
            (true, false) => self.breaks(&place, "it is no longer taken"),
            (false, true) if new["required"] == true => self.breaks(&place, "it is required"),
            (false, true) => self.adds(&place, "it may be sent"),
            (false, false) => {}
        }
    }

    fn content(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        let kinds = |part: &Value| part["content"].as_object().cloned().unwrap_or_default();
        let (before, after) = (kinds(old), kinds(new));
        for (kind, content) in &before {
            match after.get(kind) {
                Some(present) => self.schema(place, &content["schema"], &present["schema"], side),
                None => self.breaks(place, format_args!("{kind} is gone")),
            }
        }
        for kind in after.keys().filter(|kind| !before.contains_key(*kind)) {
            self.adds(place, format_args!("{kind}"));
        }
    }

    fn schema(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        if old == new && !has_reference(old) {
            return;
        }
        let (name, old) = named(self.old, old);
        let (present_name, new) = named(self.new, new);
        if let (Some(name), Some(present)) = (name, present_name)
            && !self.seen.insert((name, present, side))
        {
            return;
        }
        self.types(place, &old, &new, side);
        self.words(place, &old, &new, side);
        self.rules(place, &old, &new, side);
        self.properties(place, &old, &new, side);
        if old["items"].is_object() || new["items"].is_object() {
            self.schema(&format!("{place}[]"), &old["items"], &new["items"], side);
        }
        for choice in ["oneOf", "anyOf", "allOf"] {
            let parts = |schema: &Value| schema[choice].as_array().cloned().unwrap_or_default();
            let (before, after) = (parts(&old), parts(&new));
            if before.len() == after.len() {
                for (old, new) in before.iter().zip(&after) {
                    self.schema(place, old, new, side);
                }
            } else {
                self.breaks(place, format_args!("it has {} shapes instead of {}", after.len(), before.len()));
            }
        }
    }

    fn types(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        let (before, after) = (types(old), types(new));
        if old["format"] != new["format"] {
            self.breaks(place, format_args!("its format is {} instead of {}", new["format"], old["format"]));
        }
        if before == after {
            return;
        }
        let (accepted, given) = match side {
            Side::Request => (&after, &before),
            Side::Answer => (&before, &after),
        };
        let fits = accepted.is_empty()
            || !given.is_empty()
                && given.iter().all(|kind| accepted.contains(kind) || kind == "integer" && accepted.contains("number"));
        let change = format!("its type is {after:?} instead of {before:?}");
        if fits { self.adds(place, change) } else { self.breaks(place, change) }
    }

    fn words(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        match (words(old), words(new), side) {
            (Some(before), Some(after), _) => {
                for word in before.difference(&after) {
                    self.breaks(place, format_args!("{word} is gone"));
                }
                for word in after.difference(&before) {
                    self.adds(place, format_args!("the new word {word}"));
                }
            }
            (None, Some(_), Side::Request) => self.breaks(place, "only certain words are accepted"),
            (Some(_), None, Side::Answer) => self.breaks(place, "any text may be answered"),
            (None, Some(_), Side::Answer) | (Some(_), None, Side::Request) => self.adds(place, "its words changed"),
            (None, None, _) => {}
        }
    }

    /// Ranges, lengths and patterns matter where a client sends a value.
    fn rules(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        if side == Side::Answer {
            return;
        }
        let lower = ["minimum", "exclusiveMinimum", "minLength", "minItems"].map(|rule| (rule, 1.0));
        let upper = ["maximum", "exclusiveMaximum", "maxLength", "maxItems"].map(|rule| (rule, -1.0));
        for (rule, sign) in lower.into_iter().chain(upper) {
            let limit = |schema: &Value| schema[rule].as_f64().map_or(f64::NEG_INFINITY, |limit| sign * limit);
            let change = format!("{rule} is {} instead of {}", new[rule], old[rule]);
            if limit(new) > limit(old) {
                self.breaks(place, change);
            } else if limit(new) < limit(old) {
                self.adds(place, change);
            }
        }
        if old["pattern"] != new["pattern"] {
            let change = format!("its pattern is {} instead of {}", new["pattern"], old["pattern"]);
            if new["pattern"].is_null() { self.adds(place, change) } else { self.breaks(place, change) }
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
                self.breaks(&inside, "the field is gone");
                continue;
            };
            match (required(old, name), required(new, name), side) {
                (false, true, Side::Request) => self.breaks(&inside, "the field is required"),
                (true, false, Side::Answer) => self.breaks(&inside, "the field may be missing"),
                (false, true, Side::Answer) | (true, false, Side::Request) => {
                    self.adds(&inside, "always or never there");
                }
                _ => {}
            }
            self.schema(&inside, field, present, side);
        }
        for name in after.keys().filter(|name| !before.contains_key(*name)) {
            if side == Side::Request && required(new, name) {
                self.breaks(place, format_args!("the new field {name} is required"));
            } else {
                self.adds(place, format_args!("the new field {name}"));
            }
        }
        let (open, closed) = (&old["additionalProperties"], &new["additionalProperties"]);
        if closed == false && open != false && side == Side::Request && old["type"] == "object" {
            self.breaks(place, "other fields are refused");
        }
        if open.is_object() && closed.is_object() {
            self.schema(&format!("{place}{{}}"), open, closed, side);
        }
    }
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

fn has_reference(schema: &Value) -> bool {
    match schema {
        Value::Object(fields) => fields.contains_key("$ref") || fields.values().any(has_reference),
        Value::Array(parts) => parts.iter().any(has_reference),
        _ => false,
    }
}

/// The schema that a reference leads to, and its name.
fn named(document: &Value, schema: &Value) -> (Option<String>, Value) {
    let Some(reference) = schema["$ref"].as_str() else { return (None, schema.clone()) };
    let found = document.pointer(reference.trim_start_matches('#')).cloned().unwrap_or_default();
    (Some(reference.to_owned()), found)
}

fn types(schema: &Value) -> BTreeSet<String> {
    match &schema["type"] {
        Value::String(kind) => BTreeSet::from([kind.clone()]),
        Value::Array(kinds) => kinds.iter().map(|kind| text(kind).to_owned()).collect(),
        _ => BTreeSet::new(),
    }
}

fn words(schema: &Value) -> Option<BTreeSet<String>> {
    Some(schema["enum"].as_array()?.iter().map(Value::to_string).collect())
}

#[cfg(test)]
mod tests {
    use super::compare;
    use serde_json::{Value, json};

    fn description() -> Value {
        json!({
            "paths": { "/things": { "post": {
                "operationId": "create_thing",
                "security": [{ "token": ["run"] }],
                "parameters": [{ "name": "limit", "in": "query", "required": false, "schema": { "type": "integer", "maximum": 9 } }],
                "requestBody": { "required": true, "content": { "application/json": { "schema": { "$ref": "#/components/schemas/New" } } } },
                "responses": {
                    "201": { "content": { "application/json": { "schema": { "$ref": "#/components/schemas/Thing" } } } },
                    "404": {}
                }
            } } },
            "components": { "schemas": {
                "New": { "type": "object", "required": ["kind"], "properties": {
                    "kind": { "type": "string", "enum": ["a", "b"] },
                    "size": { "type": "number", "minimum": 0 }
                } },
                "Thing": { "type": "object", "required": ["id"], "properties": {
                    "id": { "type": "string" },
                    "kinds": { "type": "array", "items": { "type": "string", "enum": ["a", "b"] } }
                } }
            } }
        })
    }

    /// The description with one place changed; `null` removes it.
    fn changed(pointer: &str, value: Value) -> Value {
        let mut document = description();
        let (parent, name) = pointer.rsplit_once('/').unwrap();
        let parent = document.pointer_mut(parent).unwrap().as_object_mut().unwrap();
        let name = name.replace("~1", "/");
        if value.is_null() {
            parent.remove(&name)
        } else {
            parent.insert(name, value)
        };
        document
    }

    const OPERATION: &str = "/paths/~1things/post";
    const NEW: &str = "/components/schemas/New";
    const THING: &str = "/components/schemas/Thing";

    #[test]
    fn equal_descriptions_have_no_difference() {
        assert_eq!(compare(&description(), &description()), super::Difference::default());
    }

    #[test]
    fn incompatible_change_is_a_break() {
        for (place, value, said) in [
            ("/paths/~1things".to_owned(), Value::Null, "the operation is gone"),
            (format!("{OPERATION}/operationId"), json!("make_thing"), "its name"),
            (format!("{OPERATION}/security"), json!([]), "the right that it needs"),
            (format!("{OPERATION}/parameters"), json!([]), "the parameter is gone"),
            (format!("{OPERATION}/responses/201"), Value::Null, "no longer answered with 201"),
            (format!("{OPERATION}/responses/202"), json!({}), "may be answered with 202"),
            (format!("{OPERATION}/requestBody"), Value::Null, "it is no longer taken"),
            (format!("{NEW}/required"), json!(["kind", "size"]), "the field is required"),
            (format!("{NEW}/properties/kind/enum"), json!(["a"]), "\"b\" is gone"),
            (format!("{NEW}/properties/size/minimum"), json!(1), "minimum"),
            (format!("{NEW}/properties/size/type"), json!("integer"), "its type"),
            (format!("{NEW}/properties/size/maximum"), json!(9), "maximum"),
            (format!("{NEW}/additionalProperties"), json!(false), "other fields are refused"),
            (format!("{NEW}/properties/size"), Value::Null, "the field is gone"),
            (format!("{THING}/properties/id"), Value::Null, "the field is gone"),
            (format!("{THING}/required"), json!([]), "the field may be missing"),
            (format!("{THING}/properties/id/type"), json!(["string", "null"]), "its type"),
            (format!("{THING}/properties/kinds/items/enum"), json!(["a"]), "\"b\" is gone"),
        ] {
            let found = compare(&description(), &changed(&place, value));
            assert!(found.breaks.iter().any(|one| one.contains(said)), "{place}: {found:?}");
        }
        let mut needs_more = description();
        needs_more["components"]["schemas"]["New"]["properties"]["name"] = json!({ "type": "string" });
        needs_more["components"]["schemas"]["New"]["required"] = json!(["kind", "name"]);
        assert_eq!(compare(&description(), &needs_more).breaks.len(), 1);
    }

    #[test]
    fn compatible_change_is_an_addition() {
        for (place, value) in [
            ("/paths/~1more".to_owned(), json!({ "get": {} })),
            (format!("{OPERATION}/responses/409"), json!({})),
            (format!("{OPERATION}/responses/404"), Value::Null),
            (format!("{NEW}/properties/kind/enum"), json!(["a", "b", "c"])),
            (format!("{NEW}/properties/name"), json!({ "type": "string" })),
            (format!("{NEW}/properties/size/minimum"), json!(-1)),
            (format!("{NEW}/properties/size/type"), json!(["number", "null"])),
            (format!("{THING}/properties/name"), json!({ "type": "string" })),
            (format!("{THING}/required"), json!(["id", "kinds"])),
        ] {
            let found = compare(&description(), &changed(&place, value));
            assert!(found.breaks.is_empty(), "{place}: {found:?}");
        }
        let more = compare(&description(), &changed("/paths/~1more", json!({ "get": {} })));
        assert_eq!(more.additions, ["get /more: a new operation"]);
    }
}
