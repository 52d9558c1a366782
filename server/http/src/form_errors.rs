//! Refused form fields, in the words of the form, with what was probably meant where that can be known.

use crate::body_measures::{likely, likely_height_m, likely_mass_kg};
use crate::bound_units;
use gait_optimizer::TunedBounds;
use gait_optimizer::number_format::with_unit;
use gaitwright_service::error::{Error, FieldError};
use gaitwright_store::TrialId;
use serde_json::Value;

/// Name and label of each field of a form, in its order.
pub(crate) type FieldLabels = &'static [(&'static str, &'static str)];

/// A form without an entry that the page, not a person, puts into it.
pub(crate) const INCOMPLETE_FORM: &str = "The form was not sent completely, and nothing was changed. Load the page with the \
                                          form again, then send the form.";

/// The refusal of a field that the form does not have.
pub(crate) fn unknown_field(name: &str) -> FieldError {
    FieldError::in_words(name, &format!("The form has no field {name}."))
}

/// A text in quotation marks.
pub(crate) fn quoted(text: &str) -> String {
    format!("\u{201c}{text}\u{201d}")
}

/// A refusal under the label of its field.
pub(crate) fn of_field(label: &str, fault: &FieldError) -> String {
    let Some(allowed) = fault.allowed.as_deref() else {
        // A sentence that begins with the name of the field, such as `recording, line 3: ...`.
        let rest = fault.message.strip_prefix(&fault.field).filter(|rest| rest.starts_with([':', ',']));
        return rest.map_or_else(|| fault.message.clone(), |rest| format!("{label}{rest}"));
    };
    let sentence = FieldError::sentence(&quoted(label), given(fault).as_deref(), allowed);
    near_miss(fault).map_or_else(|| sentence.clone(), |meant| format!("{sentence} Did you mean {meant}?"))
}

/// The refused value as the form shows it.
fn given(fault: &FieldError) -> Option<String> {
    match &fault.value {
        // The form shows names in place of identifiers.
        Some(Value::String(text)) if !text.is_empty() && text.parse::<TrialId>().is_err() => Some(quoted(text)),
        Some(Value::Number(number)) => {
            let text = number.to_string();
            Some(text.strip_suffix(".0").unwrap_or(&text).to_owned())
        }
        _ => None,
    }
}

/// Name on a page of a field that has no label.
pub(crate) const WITHOUT_LABEL: &str = "This entry";

/// A refusal of a field that has no label, because no person fills it in.
pub(crate) fn without_label(fault: &FieldError) -> String {
    match (&fault.allowed, &fault.value) {
        // A sentence of its own is about the form as a whole.
        (None, _) => fault.message.clone(),
        (Some(_), Some(Value::String(text))) if text.is_empty() => INCOMPLETE_FORM.to_owned(),
        (Some(allowed), _) => FieldError::sentence(WITHOUT_LABEL, given(fault).as_deref(), allowed),
    }
}

/// The entry that was probably meant: the same number in another unit, or with a decimal point in place of a comma.
fn near_miss(fault: &FieldError) -> Option<String> {
    let number = match fault.value.as_ref()? {
        Value::Number(number) => number.as_f64()?,
        Value::String(text) => text.trim().replace(',', ".").parse().ok().filter(|number: &f64| number.is_finite())?,
        _ => return None,
    };
    let field = fault.field.rsplit('.').next().unwrap_or_default();
    if field.ends_with("height_m") {
        return likely_height_m(number).map(|height| format!("{height} m"));
    }
    if field.ends_with("body_mass_kg") {
        return likely_mass_kg(number).map(|mass| format!("{mass} kg"));
    }
    let bound = field.rsplit('_').next().unwrap_or_default();
    let place = TunedBounds::place_of(bound)?;
    let unit = bound_units::unit(bound);
    let (low, high) = TunedBounds::RANGES[place];
    let range = (bound_units::shown(bound, low), bound_units::shown(bound, high));
    let meant = match unit {
        "m" => likely(number, range, [1.0, 0.01, 0.001]),
        "°" | "°/s" | "°/s²" => likely(number, range, [1.0, 1_f64.to_degrees()]),
        _ => None,
    }?;
    Some(with_unit(meant, unit))
}

/// The sentence of an error, with the label of the refused field.
pub(crate) fn of_form(error: &Error, labels: FieldLabels) -> String {
    match error {
        Error::Invalid(fault) => labelled(fault, labels),
        _ => error.to_string(),
    }
}

fn labelled(fault: &FieldError, labels: FieldLabels) -> String {
    // A form shows a field of a part of the request, such as `reading.rate_hz`, without the part.
    let name = fault.field.rsplit('.').next().unwrap_or_default();
    let found = labels.iter().find(|(field, _)| *field == name);
    found.map_or_else(|| without_label(fault), |(_, label)| of_field(label, fault))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: FieldLabels = &[("recording", "File contents")];

    #[test]
    fn sentences_about_files_begin_with_the_label_of_the_field() {
        let fault = FieldError::in_words("recording", "recording, line 1: the first column is \"t\"");
        assert_eq!(labelled(&fault, FILE), "File contents, line 1: the first column is \"t\"");
        let fault = FieldError::in_words("recording", "recording: column \"RF_L\" is missing");
        assert_eq!(labelled(&fault, FILE), "File contents: column \"RF_L\" is missing");
    }

    #[test]
    fn refusal_without_a_label_names_no_field() {
        let hidden = |given: &str| labelled(&FieldError::new("key", given, "an identifier from this form"), FILE);
        assert_eq!(hidden(""), INCOMPLETE_FORM);
        assert_eq!(hidden("x"), "This entry is \u{201c}x\u{201d}; it must be an identifier from this form.");
        let sentence = FieldError::in_words("", "The two gaits are equal.");
        assert_eq!(labelled(&sentence, FILE), "The two gaits are equal.");
    }

    #[test]
    fn refusal_suggests_the_value_in_the_unit_of_the_field() {
        for (fault, expected) in [
            (FieldError::new("height_m", 173.0, "1.4 to 2.2"), Some("1.73 m")),
            (FieldError::new("height_m", "1,73", "a number"), Some("1.73 m")),
            (FieldError::new("body_mass_kg", 250.0, "35 to 160"), Some("113 kg")),
            (FieldError::new("subject.body_mass_kg", 250.0, "35 to 160"), Some("113 kg")),
            (FieldError::new("values_a5", 50.0, "0 to 0.3"), Some("0.05 m")),
            (FieldError::new("values_a5", 20.0, "0 to 0.3"), None),
            (FieldError::new("fixed_a6", 70.0, "0 to 57.3°"), None),
            (FieldError::new("values_a1", "20", "57.3 to 5730 °/s"), Some("1146 °/s")),
            (FieldError::new("fixed_a7", 0.35, "5 to 68"), Some("20.1°")),
            (FieldError::new("height_m", 0.1, "1.4 to 2.2"), None),
            (FieldError::new("height_m", "tall", "a number"), None),
            (FieldError::new("seed", 1.5, "0 to 9"), None),
        ] {
            assert_eq!(near_miss(&fault).as_deref(), expected, "{fault:?}");
        }
        let shown = of_field("Height, m", &FieldError::new("height_m", 173.0, "1.4 to 2.2"));
        assert_eq!(shown, "\u{201c}Height, m\u{201d} is 173; it must be 1.4 to 2.2. Did you mean 1.73 m?");
    }
}
