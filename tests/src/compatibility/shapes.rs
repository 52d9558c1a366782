//! The alternatives of a schema (`oneOf`, `anyOf`, or a type that may be null), and which of two schemas correspond.

use serde_json::{Value, json};

const CHOICES: [&str; 2] = ["oneOf", "anyOf"];

/// The alternatives of two schemas.
pub(super) struct Matched {
    /// Alternatives that correspond.
    pub(super) pairs: Vec<(Value, Value)>,
    /// Identities of those that only the old schema has.
    pub(super) gone: Vec<String>,
    /// Identities of those that only the new schema has.
    pub(super) added: Vec<String>,
}

pub(super) fn has_choice(schema: &Value) -> bool {
    CHOICES.iter().any(|choice| schema[choice].is_array())
}

/// Matches alternatives by what identifies them, and the others by their order. A null corresponds to no other alternative.
pub(super) fn matched(old: &Value, new: &Value) -> Matched {
    let (mut pairs, mut before, mut after) = (Vec::new(), Vec::new(), shapes(new));
    for shape in shapes(old) {
        match after.iter().position(|other| identity(other) == identity(&shape)) {
            Some(index) => pairs.push((shape, after.remove(index))),
            None => before.push(shape),
        }
    }
    for rest in [&mut before, &mut after] {
        rest.sort_by_key(|shape| shape["type"] == "null");
    }
    let both = before.len().min(after.len());
    pairs.extend(before.drain(..both).zip(after.drain(..both)));
    let identities = |shapes: Vec<Value>| shapes.iter().map(identity).collect();
    Matched { pairs, gone: identities(before), added: identities(after) }
}

fn shapes(schema: &Value) -> Vec<Value> {
    if let Some(parts) = CHOICES.iter().find_map(|choice| schema[choice].as_array()) {
        return parts.iter().flat_map(shapes).collect();
    }
    // The default belongs to the whole schema.
    let mut alone = schema.clone();
    alone.as_object_mut().and_then(|fields| fields.remove("default"));
    let Some(kinds) = schema["type"].as_array() else { return vec![alone] };
    let of_kind = |kind: &Value| {
        let mut shape = if kind == "null" { json!({}) } else { alone.clone() };
        shape["type"] = kind.clone();
        shape
    };
    kinds.iter().map(of_kind).collect()
}

/// The name of an alternative, or its type with the fields that have one possible value.
fn identity(shape: &Value) -> String {
    if let Some(name) = shape["$ref"].as_str() {
        return name.to_owned();
    }
    let tags = shape["properties"].as_object().into_iter().flatten().filter_map(|(name, field)| {
        let [value] = field["enum"].as_array()?.as_slice() else { return None };
        Some(format!(" {name} {value}"))
    });
    shape["type"].as_str().unwrap_or_default().to_owned() + &tags.collect::<String>()
}
