//! Bodies drawn from a schema of the description: valid ones, and ones that violate the schema in one place.

use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Characters of drawn texts: multi-byte characters, other scripts, and those with a meaning in formulas, HTML and
/// quotes.
const LETTERS: [char; 16] =
    ['a', 'Z', '7', ' ', 'é', 'ß', '𝄞', '足', '"', '\'', '=', '<', '&', '\\', '\u{ad}', '\u{200d}'];

/// Draws from the schemas of a description.
pub struct Drawn {
    document: Value,
    state: u64,
    texts: u64,
    /// Values to draw from for fields that refer to an object.
    pub known: BTreeMap<&'static str, Vec<Value>>,
}

impl Drawn {
    /// Draws from a description.
    pub fn from(document: Value) -> Self {
        Self { document, state: 1, texts: 0, known: BTreeMap::new() }
    }

    /// A whole number below `end` (SplitMix64, Steele et al. 2014).
    pub fn below(&mut self, end: u64) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) % end
    }

    fn one_of(&mut self, values: &[Value]) -> Value {
        values[usize::try_from(self.below(values.len() as u64)).unwrap()].clone()
    }

    /// The schema behind a reference.
    pub fn resolved(&self, schema: &Value) -> Value {
        match schema["$ref"].as_str() {
            Some(path) => self.resolved(&self.document.pointer(&path[1..]).unwrap().clone()),
            None => schema.clone(),
        }
    }

    /// A body that fits the schema.
    pub fn body(&mut self, schema: &Value) -> Value {
        self.value("", schema)
    }

    fn value(&mut self, field: &str, schema: &Value) -> Value {
        let schema = &self.resolved(schema);
        // A field of words can have the name of a field with known values.
        if let Some(known) = self.known.get(field).cloned()
            && !(schema["enum"].is_array() && known.iter().all(Value::is_boolean))
        {
            return self.one_of(&known);
        }
        if let Some(branches) = schema["oneOf"].as_array() {
            let branch = self.one_of(branches);
            return self.value(field, &branch);
        }
        if let Some(words) = schema["enum"].as_array() {
            return self.one_of(words);
        }
        let kind = match &schema["type"] {
            Value::Array(kinds) => self.one_of(kinds),
            kind => kind.clone(),
        };
        match kind.as_str().unwrap_or_else(|| panic!("{field} has no type: {schema}")) {
            "null" => Value::Null,
            "boolean" => json!(self.below(2) == 0),
            "number" => self.number(schema),
            "integer" => self.integer(schema),
            "string" => self.text(schema),
            "array" => {
                let least = schema["minItems"].as_u64().unwrap_or(0);
                let count = least + self.below(3);
                Value::Array((0..count).map(|_| self.value(field, &schema["items"])).collect())
            }
            "object" => self.object(schema),
            other => panic!("{field}: {other} is not drawn"),
        }
    }

    fn number(&mut self, schema: &Value) -> Value {
        let least = schema["minimum"].as_f64().unwrap_or(-1e6);
        let most = schema["maximum"].as_f64().or_else(|| schema["exclusiveMaximum"].as_f64().map(f64::next_down));
        let most = most.unwrap_or(1e6);
        json!(match self.below(4) {
            0 => least,
            1 => most,
            _ => least + (most - least) * (self.below(1000) as f64 / 1000.0),
        })
    }

    fn integer(&mut self, schema: &Value) -> Value {
        let widest = if schema["format"] == "int64" { i64::MAX } else { i64::from(i32::MAX) };
        let (least, most) = (whole(&schema["minimum"]), whole(&schema["maximum"]).unwrap_or(widest));
        let least = least.unwrap_or(-widest);
        let width = u64::try_from(most.saturating_sub(least)).unwrap();
        json!(match self.below(4) {
            0 => least,
            1 => most,
            _ => least + i64::try_from(self.below(width.max(1))).unwrap(),
        })
    }

    fn text(&mut self, schema: &Value) -> Value {
        if schema["format"] == "uuid" {
            return json!("01890000-0000-7000-8000-000000000000");
        }
        if schema["format"] == "date-time" {
            return json!("2026-05-01T10:15:00.000Z");
        }
        let pattern = schema["pattern"].as_str().unwrap_or_default();
        let least = schema["minLength"].as_u64().unwrap_or(u64::from(pattern == r"\S"));
        let most = schema["maxLength"].as_u64().unwrap_or(40);
        let length = match self.below(4) {
            0 => least,
            1 => most,
            _ => least + self.below(most - least + 1),
        };
        self.texts += 1;
        // Names must be unique, so a number is appended if there is room.
        let letter = |digit: u32| char::from_u32(u32::from('a') + digit).unwrap();
        let code: String = self.texts.to_string().chars().filter_map(|c| c.to_digit(10)).map(letter).collect();
        let is_code = pattern.starts_with("^(?!");
        let mut text: Vec<char> = code.chars().take(usize::try_from(length).unwrap()).collect();
        while (text.len() as u64) < length {
            let letter = LETTERS[usize::try_from(self.below(LETTERS.len() as u64)).unwrap()];
            let line = if pattern.contains(r"\t\r\n") { letter } else { ['\n', '\t', letter, letter][text.len() % 4] };
            text.push(if is_code { '-' } else { line });
        }
        json!(text.into_iter().collect::<String>())
    }

    fn object(&mut self, schema: &Value) -> Value {
        let required = schema["required"].as_array().cloned().unwrap_or_default();
        let properties = schema["properties"].as_object().cloned().unwrap_or_default();
        // Only few of many settings are changed at the same time, because some depend on each other.
        let one_in = (properties.len() as u64 / 4).max(2);
        let mut object = Map::new();
        for (name, property) in &properties {
            if required.contains(&json!(name)) || self.below(one_in) == 0 {
                object.insert(name.clone(), self.value(name, property));
            }
        }
        if schema["additionalProperties"].is_object() {
            let names = schema["propertyNames"]["enum"].as_array().cloned();
            let name = names.map_or_else(|| json!("more"), |names| self.one_of(&names));
            let value = self.value("", &schema["additionalProperties"]);
            object.insert(name.as_str().unwrap().to_owned(), value);
        }
        self.keep_condition(schema, &mut object);
        Value::Object(object)
    }

    /// Draws values that a condition of the schema requires.
    fn keep_condition(&mut self, schema: &Value, object: &mut Map<String, Value>) {
        let Some(conditions) = schema["if"]["properties"].as_object() else { return };
        let holds = conditions.iter().all(|(name, wanted)| object.get(name) == Some(&wanted["const"]));
        let branch = if holds { &schema["then"] } else { &schema["else"] };
        for name in branch["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            let mut property = self.resolved(&schema["properties"][name]);
            for (rule, value) in branch["properties"][name].as_object().into_iter().flatten() {
                property[rule] = value.clone();
            }
            let value = self.value(name, &property);
            object.insert(name.to_owned(), value);
        }
    }

    /// Bodies that violate the schema in one place, each with a description of the violation.
    pub fn beyond(&mut self, schema: &Value) -> Vec<(String, Value)> {
        let schema = self.resolved(schema);
        let mut found = Vec::new();
        if schema["additionalProperties"] == false {
            found.push(("an unknown field".to_owned(), self.with(&schema, "no_such_field", json!(1))));
        }
        for name in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            let mut body = self.body(&schema);
            body.as_object_mut().unwrap().remove(name);
            found.push((format!("{name} is missing"), body));
        }
        for (name, property) in schema["properties"].as_object().into_iter().flatten() {
            let property = self.resolved(property);
            for (why, wrong) in wrong_values(&property) {
                found.push((format!("{name}: {why}"), self.with(&schema, name, wrong)));
            }
            if property["properties"].is_object() {
                for (why, wrong) in self.beyond(&property) {
                    found.push((format!("{name}.{why}"), self.with(&schema, name, wrong)));
                }
            }
        }
        found
    }

    fn with(&mut self, schema: &Value, name: &str, value: Value) -> Value {
        let mut body = self.body(schema);
        body[name] = value;
        body
    }
}

/// Values that a property does not accept.
fn wrong_values(property: &Value) -> Vec<(&'static str, Value)> {
    let mut wrong = Vec::new();
    let is =
        |kind: &str| property["type"] == kind || property["type"].as_array().is_some_and(|k| k.contains(&json!(kind)));
    if !is("object") && property["type"] != Value::Null {
        wrong.push(("an object", json!({})));
    }
    if !property["enum"].is_null() {
        wrong.push(("no word of the list", json!("no such word")));
    }
    if is("integer") {
        let beyond = [
            whole(&property["minimum"]).and_then(|least| least.checked_sub(1)),
            whole(&property["maximum"]).and_then(|most| most.checked_add(1)),
        ];
        wrong.extend(beyond.into_iter().flatten().map(|beyond| ("out of range", json!(beyond))));
    } else if let (Some(least), Some(most)) = (property["minimum"].as_f64(), property["maximum"].as_f64()) {
        let step = 1e-6 * (most - least);
        wrong.extend([least - step, most + step].map(|beyond| ("out of range", json!(beyond))));
    }
    if let Some(most) = property["maxLength"].as_u64() {
        wrong.push(("too long", json!("x".repeat(usize::try_from(most).unwrap() + 1))));
    }
    if property["minLength"].as_u64().is_some_and(|least| least > 0) {
        wrong.push(("empty", json!("")));
    }
    if property["pattern"].is_string() {
        wrong.push(("a character that does not print", json!("a\u{1}b")));
    }
    wrong
}

/// A whole number of a schema, however it is written.
fn whole(value: &Value) -> Option<i64> {
    value.as_i64().or_else(|| value.as_f64()?.to_string().parse().ok())
}
