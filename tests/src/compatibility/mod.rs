//! Compares two descriptions of the REST interface: which changes break clients, and which are additions.

mod callers;
mod difference;
mod schemas;
mod shapes;
#[cfg(test)]
mod tests;

pub use difference::Difference;

use schemas::{Schemas, Side};
use serde_json::Value;
use std::collections::BTreeMap;

/// Compares the description that clients know with a new one.
pub fn compare(old: &Value, new: &Value) -> Difference {
    let mut comparison = Comparison { schemas: Schemas::new(old, new) };
    let (before, after) = (operations(old), operations(new));
    for (what, operation) in &before {
        match after.get(what) {
            Some(present) => comparison.operation(what, operation, present),
            None => comparison.difference().breaks(what, "the operation is gone"),
        }
    }
    for what in after.keys().filter(|what| !before.contains_key(*what)) {
        comparison.difference().adds(what, "a new operation");
    }
    comparison.schemas.difference
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
    schemas: Schemas<'a>,
}

impl Comparison<'_> {
    fn difference(&mut self) -> &mut Difference {
        &mut self.schemas.difference
    }

    fn operation(&mut self, what: &str, old: &Value, new: &Value) {
        let (name, present) = (&old["operationId"], &new["operationId"]);
        if name != present {
            self.difference().breaks(what, format_args!("its name is {present} instead of {name}"));
        }
        let (needed, needs) = (&old["security"], &new["security"]);
        if needed != needs {
            let is_break = !callers::all_can_still_call(needed, needs);
            self.difference().note(is_break, what, format_args!("it needs the right {needs} instead of {needed}"));
        }
        self.parameters(what, old, new);
        self.body(what, &old["requestBody"], &new["requestBody"]);
        self.responses(what, old, new);
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
                self.difference().breaks(&place, "the parameter is gone");
                continue;
            };
            if parameter["required"] != true && present["required"] == true {
                self.difference().breaks(&place, "the parameter is required");
            }
            self.schemas.schema(&place, &parameter["schema"], &present["schema"], Side::Request);
        }
        for (name, parameter) in after.iter().filter(|(name, _)| !before.contains_key(*name)) {
            if parameter["required"] == true {
                self.difference().breaks(what, format_args!("the new parameter {name} is required"));
            } else {
                self.difference().adds(what, format_args!("the new parameter {name}"));
            }
        }
    }

    fn body(&mut self, what: &str, old: &Value, new: &Value) {
        let place = format!("{what} body");
        match (old.is_object(), new.is_object()) {
            (true, true) => {
                if old["required"] != true && new["required"] == true {
                    self.difference().breaks(&place, "it is required");
                }
                self.content(&place, old, new, Side::Request);
            }
            (true, false) => self.difference().breaks(&place, "it is no longer taken"),
            (false, true) if new["required"] == true => self.difference().breaks(&place, "it is required"),
            (false, true) => self.difference().adds(&place, "it may be sent"),
            (false, false) => {}
        }
    }

    fn responses(&mut self, what: &str, old: &Value, new: &Value) {
        let successes = |operation: &Value| -> BTreeMap<String, Value> {
            let responses = operation["responses"].as_object().cloned().unwrap_or_default();
            responses.into_iter().filter(|(status, _)| status.starts_with('2')).collect()
        };
        let (before, after) = (successes(old), successes(new));
        for status in after.keys().filter(|status| !before.contains_key(*status)) {
            self.difference().breaks(what, format_args!("it may be answered with {status}"));
        }
        for (status, response) in &before {
            let place = format!("{what} {status}");
            match after.get(status) {
                Some(present) => {
                    self.content(&place, response, present, Side::Response);
                    self.headers(&place, response, present);
                }
                None => self.difference().breaks(what, format_args!("it is no longer answered with {status}")),
            }
        }
    }

    fn headers(&mut self, place: &str, old: &Value, new: &Value) {
        let headers = |response: &Value| response["headers"].as_object().cloned().unwrap_or_default();
        let (before, after) = (headers(old), headers(new));
        for (name, header) in &before {
            match after.get(name) {
                Some(present) => {
                    let inside = format!("{place} {name}");
                    self.schemas.schema(&inside, &header["schema"], &present["schema"], Side::Response);
                }
                None => self.difference().breaks(place, format_args!("the header {name} is gone")),
            }
        }
        for name in after.keys().filter(|name| !before.contains_key(*name)) {
            self.difference().adds(place, format_args!("the new header {name}"));
        }
    }

    fn content(&mut self, place: &str, old: &Value, new: &Value, side: Side) {
        let kinds = |part: &Value| part["content"].as_object().cloned().unwrap_or_default();
        let (before, after) = (kinds(old), kinds(new));
        for (kind, content) in &before {
            match after.get(kind) {
                Some(present) => self.schemas.schema(place, &content["schema"], &present["schema"], side),
                None => self.difference().breaks(place, format_args!("{kind} is gone")),
            }
        }
        for kind in after.keys().filter(|kind| !before.contains_key(*kind)) {
            self.difference().adds(place, format_args!("{kind}"));
        }
    }
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}
