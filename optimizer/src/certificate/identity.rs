//! What a certificate is about: which gait of which walker, and every value that differs from the built-in problem.

use crate::body::WalkerModel;
use crate::cost_of_transport::unsmoothed_cost_of_transport;
use crate::device::Device;
use crate::gait::Gait;
use crate::model_error::ModelError;
use crate::settings::GaitSettings;
use crate::subject::Subject;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The gait that a certificate is about. Everything here is computed from the gait.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CertifiedGait {
    /// SHA-256 of the gait as compact JSON, hexadecimal.
    pub gait_sha256: String,
    /// Version of the optimiser that made the certificate.
    pub optimizer_version: String,
    /// The subject.
    pub subject: Subject,
    /// Name of the device. Only [`Self::differences`] tells whether its values are those of the built-in device.
    pub device: String,
    /// Whether the muscle constraints C5 to C12 were checked.
    pub muscles: bool,
    /// Values of the device and of the settings that differ from AMPRO3 and the default settings.
    pub differences: Vec<Difference>,
    /// Mechanical cost of transport with the magnitudes |P| of the joint powers, dimensionless. The objective, and with
    /// it the report of a solve, has a smoothed magnitude, which is smaller.
    pub unsmoothed_cost_of_transport: f64,
}

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

impl CertifiedGait {
    /// What a certificate of the gait is about, without certifying it.
    ///
    /// # Errors
    /// [`ModelError`] if the gait is malformed.
    pub fn of(gait: &Gait) -> Result<Self, ModelError> {
        gait.validate()?;
        let total_mass_kg = WalkerModel::new(&gait.subject, &gait.device)?.total_mass;
        Ok(Self {
            gait_sha256: gait.sha256()?,
            optimizer_version: env!("CARGO_PKG_VERSION").to_owned(),
            subject: gait.subject,
            device: gait.device.name.clone(),
            muscles: gait.muscles,
            differences: differences(gait)?,
            unsmoothed_cost_of_transport: unsmoothed_cost_of_transport(gait, total_mass_kg),
        })
    }
}

impl CertifiedGait {
    /// Subject, device and variant as text.
    pub fn walker_in_words(&self) -> String {
        let Subject { height_m, body_mass_kg } = self.subject;
        let muscles = if self.muscles { "with muscles" } else { "without muscles" };
        format!("subject: {height_m} m, {body_mass_kg} kg; device: {}; {muscles}", self.device)
    }
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

fn differences(gait: &Gait) -> Result<Vec<Difference>, ModelError> {
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
