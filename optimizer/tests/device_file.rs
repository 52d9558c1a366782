//! Tests of the documented format of device files.

#![allow(clippy::unwrap_used, clippy::panic)]

use gait_optimizer::body::WalkerModel;
use gait_optimizer::{Device, Subject};
use serde_json::{Value, json};

const DESCRIPTION: &str = include_str!("../data/README.md");

fn builtin() -> Value {
    serde_json::to_value(Device::ampro3().unwrap()).unwrap()
}

fn with(field: &str, value: &Value) -> Result<Device, String> {
    let mut device = builtin();
    device[field] = value.clone();
    Device::from_json(&device.to_string()).map_err(|e| e.to_string())
}

/// Field and range of each number in the documentation.
fn described() -> Vec<(&'static str, f64, f64)> {
    let devices = DESCRIPTION.split("\n## ").find(|section| section.starts_with("Devices")).unwrap();
    let rows = devices.lines().filter(|line| line.starts_with("| `"));
    rows.filter_map(|row| {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let (low, high) = cells[3].split_once(" to ")?;
        Some((cells[1].trim_matches('`'), low.parse().unwrap(), high.parse().unwrap()))
    })
    .collect()
}

#[test]
fn documented_ranges_are_the_accepted_ranges() {
    let described = described();
    let numbers = builtin().as_object().unwrap().values().filter(|value| value.is_number()).count();
    assert_eq!(described.len(), numbers);
    for (field, low, high) in described {
        let margin = 1e-6 * (high - low);
        for inside in [low, high] {
            assert!(with(field, &json!(inside)).is_ok(), "{field} = {inside}");
        }
        for outside in [low - margin, high + margin] {
            let refusal = with(field, &json!(outside)).unwrap_err();
            assert!(refusal.contains(&format!("device.{field} is ")) && refusal.contains("; it must be "), "{refusal}");
        }
    }
}

#[test]
fn missing_unknown_and_non_numeric_fields_are_rejected_by_name() {
    let mut missing = builtin();
    missing.as_object_mut().unwrap().remove("foot_mass_kg");
    let refusal = Device::from_json(&missing.to_string()).unwrap_err().to_string();
    assert!(refusal.contains("missing field `foot_mass_kg`"), "{refusal}");
    assert!(with("colour", &json!("red")).unwrap_err().contains("unknown field `colour`"));
    assert!(with("foot_mass_kg", &json!("heavy")).unwrap_err().contains("line 1 column"));
    assert!(with("foot_mass_kg", &Value::Null).is_err());
}

#[test]
fn amputee_has_no_carried_limb() {
    let subject = Subject::builtin(1).unwrap();
    let mass = |device: &Device| WalkerModel::new(&subject, device).unwrap().total_mass;
    let carried = mass(&with("carried_limb", &json!(true)).unwrap());
    let amputee = mass(&with("carried_limb", &json!(false)).unwrap());
    // Shank and foot have 0.0465 and 0.0145 of the body mass (Winter).
    assert!((carried - amputee - 0.061 * subject.body_mass_kg).abs() < 1e-9, "{carried} {amputee}");
}
