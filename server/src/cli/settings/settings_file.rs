//! The settings file.

use super::settings_and_defaults::KNOWN;
use gaitwright_service::error::Error;
use std::collections::BTreeMap;
use std::path::Path;

pub(super) fn read(path: &Path) -> Result<String, Error> {
    std::fs::read_to_string(path).map_err(|e| Error::Malformed(format!("Cannot read {}: {e}.", path.display())))
}

pub(super) fn parse(path: &Path, text: &str) -> Result<BTreeMap<String, String>, Error> {
    let malformed = |reason: String| Error::Malformed(format!("{}: {reason}", path.display()));
    let table: toml::Table = text.parse().map_err(|e: toml::de::Error| malformed(fault(text, &e)))?;
    let mut values = BTreeMap::new();
    for (name, value) in table {
        if !KNOWN.iter().any(|(known, ..)| *known == name) {
            let known = KNOWN.iter().map(|(known, ..)| *known).collect::<Vec<_>>().join(", ");
            return Err(malformed(format!("{name} is not a setting. Settings: {known}.")));
        }
        let value = match value {
            toml::Value::String(text) => text,
            toml::Value::Integer(number) => number.to_string(),
            toml::Value::Float(number) => number.to_string(),
            toml::Value::Boolean(flag) => flag.to_string(),
            _ => return Err(malformed(format!("{name} must be a string, a number, true or false."))),
        };
        values.insert(name, value);
    }
    Ok(values)
}

/// Where a file is not TOML, and why. The line itself may hold a secret, so it is not repeated.
fn fault(text: &str, error: &toml::de::Error) -> String {
    let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    format!("line {line}, column {column}: {}.", error.message())
}
