//! The values of a gait's device and settings that differ from the built-in problem.

use crate::device::Device;
use crate::gait::Gait;
use crate::model_error::ModelError;
use crate::settings::GaitSettings;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A value that differs from the built-in problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Name, as in the gait: `settings.limits.friction`, `device.knee_torque_limit_n_m`.
    pub name: String,
    /// Value of the gait; null if it is not set.
    pub value: Value,
    /// Value of the built-in problem; null if it is not set.
    pub built_in: Value,
}

/// Name of the measured muscle values, which override the published table.
const MUSCLES: &str = "settings.muscles";

impl Difference {
    /// The difference as text.
    pub fn in_words(&self) -> String {
        let missing = if self.name.starts_with(MUSCLES) { "the published table" } else { "none" };
        let words = |value: &Value| if value.is_null() { missing.to_owned() } else { value.to_string() };
        format!("{} is {} (built-in: {})", self.name, words(&self.value), words(&self.built_in))
    }
}

fn unreadable(what: &str, error: &serde_json::Error) -> ModelError {
    ModelError::Malformed { what: what.to_owned(), reason: error.to_string() }
}

/// The values of device and settings, by name, in the order of the file.
fn values(device: &Device, settings: &GaitSettings) -> Result<Vec<(String, Value)>, ModelError> {
    let GaitSettings { mesh, limits, regularisation, naturalness, muscles } = settings;
    // Each part by itself, because the settings leave out parts that are at their defaults.
    let parts = [
        ("settings.mesh", serde_json::to_value(mesh)),
        ("settings.limits", serde_json::to_value(limits)),
        ("settings.regularisation", serde_json::to_value(regularisation)),
        ("settings.naturalness", serde_json::to_value(naturalness)),
        (MUSCLES, serde_json::to_value(muscles)),
    ];
    let mut named: Vec<(String, Value)> = Device::FIELDS
        .iter()
        .map(|field| (format!("device.{}", field.name), Value::from((field.value)(device))))
        .collect();
    named.push(("device.carried_limb".to_owned(), Value::from(device.carried_limb)));
    for (name, part) in parts {
        flatten(name, part.map_err(|e| unreadable(name, &e))?, &mut named);
    }
    Ok(named)
}

fn flatten(name: &str, value: Value, named: &mut Vec<(String, Value)>) {
    match value {
        Value::Object(fields) => {
            for (field, value) in fields {
                flatten(&format!("{name}.{field}"), value, named);
            }
        }
        value => named.push((name.to_owned(), value)),
    }
}

/// Every value that differs.
pub(super) fn differences(gait: &Gait) -> Result<Vec<Difference>, ModelError> {
    let found = values(&gait.device, &gait.settings)?;
    let built_in = values(&Device::ampro3()?, &GaitSettings::default())?;
    let of = |all: &[(String, Value)], name: &str| {
        all.iter().find(|(other, _)| other == name).map_or(Value::Null, |(_, value)| value.clone())
    };
    // An optional value is in one of the two only.
    let only_built_in = built_in.iter().filter(|(name, _)| found.iter().all(|(other, _)| other != name));
    let names = found.iter().chain(only_built_in).map(|(name, _)| name);
    let pairs =
        names.map(|name| Difference { value: of(&found, name), built_in: of(&built_in, name), name: name.clone() });
    Ok(pairs.filter(|pair| pair.value != pair.built_in).collect())
}
