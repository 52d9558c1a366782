//! Schemas of settings, found by asking the checks of the settings themselves.

use gaitwright_service::error::Error;
use gaitwright_service::json_document;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};

/// The schema of settings: the shape of their defaults, with what their own checks say when a value is far out of
/// range.
pub(super) fn settings<T>(default: T, check: impl Fn(&T) -> Option<Error>) -> Value
where
    T: Serialize + DeserializeOwned,
{
    let Ok(default) = serde_json::to_value(default) else { return json!({ "type": "object" }) };
    let refusal = |changed: &Value| -> Option<Error> {
        match serde_json::to_vec(changed).map(|bytes| json_document::read::<T>(&bytes)) {
            Ok(Ok(settings)) => check(&settings),
            Ok(Err(error)) => Some(error),
            Err(_) => None,
        }
    };
    shape(&default, "", &default, &refusal)
}

/// The schema of the part of a document at a place.
fn shape(whole: &Value, place: &str, part: &Value, refusal: &dyn Fn(&Value) -> Option<Error>) -> Value {
    let with = |value: Value| {
        let mut changed = whole.clone();
        *changed.pointer_mut(place)? = value;
        refusal(&changed)
    };
    match part {
        Value::Object(fields) => {
            let properties: Map<String, Value> = fields
                .iter()
                .map(|(name, part)| (name.clone(), shape(whole, &format!("{place}/{name}"), part, refusal)))
                .collect();
            let needed = |name: &&String| {
                let mut rest = fields.clone();
                rest.remove(*name);
                with(Value::Object(rest)).is_some()
            };
            let required: Vec<&String> = fields.keys().filter(needed).collect();
            let mut schema = json!({ "type": "object", "properties": properties, "additionalProperties": false });
            if !required.is_empty() {
                schema["required"] = json!(required);
            }
            schema
        }
        Value::Bool(_) => json!({ "type": "boolean" }),
        Value::Number(number) => number_shape(number.is_f64(), with),
        Value::String(_) => match with(json!("\u{1}")).as_ref().map(words_in) {
            Some(words) if !words.is_empty() => json!({ "enum": words }),
            _ => json!({ "type": "string" }),
        },
        Value::Array(items) => {
            let item = items.first().map(|part| shape(whole, &format!("{place}/0"), part, refusal));
            json!({ "type": "array", "items": item.unwrap_or_else(|| json!({})) })
        }
        Value::Null => {
            // Settings that are null by default are numbers, and integers if a fraction is refused without a range.
            let fraction = with(json!(0.5));
            let is_fraction = fraction.as_ref().is_none_or(|refused| range_in(refused).is_some());
            let mut schema = number_shape(is_fraction, with);
            schema["type"] = json!([schema["type"], "null"]);
            schema
        }
    }
}

/// The schema of a number; `with` returns the error for a value in its place.
fn number_shape(is_fraction: bool, with: impl Fn(Value) -> Option<Error>) -> Value {
    let mut schema = json!({ "type": if is_fraction { "number" } else { "integer" } });
    for far in [json!(1_000_000_000_u32), json!(-1_000_000_000_i64)] {
        if let Some((least, most)) = with(far).as_ref().and_then(range_in) {
            (schema["minimum"], schema["maximum"]) = (json!(least), json!(most));
        }
    }
    if !is_fraction && schema.get("minimum").is_none() {
        schema["minimum"] = json!(u8::from(with(json!(0)).is_some()));
    }
    schema
}

/// The range in an error: `0.1 to 5` of a field, or `must be 0.1 to 5` of a learner setting. A unit or a relation to
/// another field can follow it.
fn range_in(error: &Error) -> Option<(f64, f64)> {
    let text = error.to_string();
    let range = match error {
        Error::Invalid(field) | Error::Unreadable(field) => field.allowed.as_deref()?,
        _ => text.split_once("must be ")?.1,
    };
    let (least, most) = range.split_once(" to ")?;
    let most: String = most.chars().take_while(|c| c.is_ascii_digit() || "+-.e".contains(*c)).collect();
    Some((least.trim().parse().ok()?, most.trim_end_matches('.').parse().ok()?))
}

/// The allowed words in an error: `a, b, c` or `a or b`.
fn words_in(error: &Error) -> Vec<String> {
    let (Error::Invalid(field) | Error::Unreadable(field)) = error else { return Vec::new() };
    let allowed = field.allowed.as_deref().unwrap_or_default().trim_start_matches("one of ");
    let words = allowed.split(", ").flat_map(|words| words.split(" or "));
    let words: Vec<String> = words.map(|word| word.trim_matches(['`', '"', ' ']).to_owned()).collect();
    let plain = |word: &String| !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if words.iter().all(plain) { words } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use crate::openapi;
    use serde_json::Value;

    /// The numbers at any depth whose schema has no range.
    fn without_range(schema: &Value, place: &str, found: &mut Vec<String>) {
        let is = |kind: &str| schema["type"] == kind || schema["type"][0] == kind;
        let has = |end: &str| schema.get(end).is_some();
        // Counts have no largest value of their own.
        if (is("number") && !(has("minimum") && has("maximum"))) || (is("integer") && !has("minimum") && !has("enum")) {
            found.push(place.to_owned());
        }
        for (name, field) in schema["properties"].as_object().into_iter().flatten() {
            without_range(field, &format!("{place}.{name}"), found);
        }
        for part in schema["oneOf"].as_array().into_iter().flatten().chain(schema.get("items")) {
            without_range(part, place, found);
        }
    }

    #[test]
    fn every_number_of_settings_has_the_range_that_its_check_states() {
        let document = openapi::value().unwrap();
        let mut found = Vec::new();
        for component in
            ["GaitSettings", "SolveOptions", "LearnerSettings", "DeviceDefinition", "MuscleParameters", "EmgSettings"]
        {
            let schema = &document["components"]["schemas"][component];
            assert!(schema["properties"].as_object().is_some_and(|fields| !fields.is_empty()), "{component}");
            without_range(schema, component, &mut found);
        }
        assert!(found.is_empty(), "{found:?}");
    }
}
