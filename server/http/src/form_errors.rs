//! Refused form fields, in the words of the form.

use gaitwright_service::error::{Error, FieldError};
use gaitwright_store::TrialId;
use serde_json::Value;

/// Labels of fields, the same on every form that has no labels of its own.
const LABELS: &[(&str, &str)] = &[
    ("pseudonym", "Pseudonym"),
    ("height_m", "Height, m"),
    ("body_mass_kg", "Body mass, kg"),
    ("notes", "Notes"),
    ("note", "Note"),
    ("reason", "Reason"),
    ("author", "Your name or code"),
    ("answer", "Answer"),
    ("name", "Name"),
    ("who", "User or token"),
    ("password", "New password"),
    ("walk", "Walk"),
    ("recording", "File contents"),
    ("rate_hz", "Sampling rate, Hz"),
    ("channels", "Channel columns"),
    ("heel_strikes_s", "Right heel strikes, s"),
    ("heel_strike_column", "Heel strike column"),
    ("heel_strike_threshold", "Contact threshold"),
    ("force_column", "Column of the vertical force under the right foot"),
    ("unit", "Angle unit of an OpenSim file"),
    ("cutoff_hz", "Low-pass cut-off, Hz"),
    ("band_low_hz", "Band-pass from, Hz"),
    ("band_high_hz", "Band-pass to, Hz"),
    ("envelope_hz", "Low-pass cut-off, Hz"),
    ("order", "Filter order"),
    ("walks", "Number of walks on each ground"),
    ("seed", "Seed"),
];

/// A text in quotation marks.
pub(crate) fn quoted(text: &str) -> String {
    format!("\u{201c}{text}\u{201d}")
}

/// A refusal under the label of its field.
pub(crate) fn of_field(label: &str, fault: &FieldError) -> String {
    let Some(allowed) = fault.allowed.as_deref() else { return fault.message.clone() };
    let given = match &fault.value {
        // The form shows names in place of identifiers.
        Some(Value::String(text)) if !text.is_empty() && text.parse::<TrialId>().is_err() => Some(quoted(text)),
        Some(Value::Number(number)) => Some(number.to_string()),
        _ => None,
    };
    FieldError::sentence(&quoted(label), given.as_deref(), allowed)
}

/// The sentence of an error, with the label of the refused field: from `labels`, or else the common one.
pub(crate) fn of_form(error: &Error, labels: &[(&str, &str)]) -> String {
    match error {
        Error::Invalid(fault) => labelled(fault, labels),
        _ => error.to_string(),
    }
}

/// The sentence of an error, with the common label of the refused field.
pub(crate) fn in_words(error: &Error) -> String {
    of_form(error, &[])
}

/// The same refusal, with the common label of its field.
pub(crate) fn with_label(fault: FieldError) -> FieldError {
    FieldError { message: labelled(&fault, &[]), ..fault }
}

fn labelled(fault: &FieldError, labels: &[(&str, &str)]) -> String {
    // A form shows a field of a part of the request, such as `reading.rate_hz`, without the part.
    let name = fault.field.rsplit('.').next().unwrap_or_default();
    let found = labels.iter().chain(LABELS).find(|(field, _)| *field == name);
    found.map_or_else(|| fault.message.clone(), |(_, label)| of_field(label, fault))
}
