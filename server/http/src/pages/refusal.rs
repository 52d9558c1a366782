//! Refused form fields, in the words of the form.

use gaitwright_service::error::{Error, FieldError};
use gaitwright_store::TrialId;
use serde_json::Value;

/// A refusal under the label of its field.
pub(super) fn of_field(label: &str, fault: &FieldError) -> String {
    let Some(allowed) = fault.allowed.as_deref() else { return fault.message.clone() };
    let given = match &fault.value {
        // The form shows names in place of identifiers.
        Some(Value::String(text)) if !text.is_empty() && text.parse::<TrialId>().is_err() => {
            Some(format!("\u{201c}{text}\u{201d}"))
        }
        Some(Value::Number(number)) => Some(number.to_string()),
        _ => None,
    };
    let allowed = allowed.trim_end_matches('.');
    match given {
        Some(given) => format!("{label} is {given}; it must be {allowed}."),
        None => format!("{label} must be {allowed}."),
    }
}

/// The sentence of an error, with the label of the refused field if the form has one.
pub(super) fn of_form(error: &Error, labels: &[(&str, &str)]) -> String {
    match error {
        Error::Invalid(fault) => labels
            .iter()
            .find(|(field, _)| *field == fault.field)
            .map_or_else(|| error.to_string(), |(_, label)| of_field(label, fault)),
        _ => error.to_string(),
    }
}
