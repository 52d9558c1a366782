//! Bounds as pages and charts show them and as forms read them: angles in degrees. REST, files and the command line have radians.

use crate::format;
use gait_optimizer::number_format::with_unit;
use gait_optimizer::{DisplayAngleUnit, TunedBounds};

/// The unit of angles on pages and charts.
pub(crate) const ANGLES: DisplayAngleUnit = DisplayAngleUnit::Degree;

/// The unit in which a bound is shown; empty for any other name.
pub(crate) fn unit(name: &str) -> &'static str {
    ANGLES.of(TunedBounds::unit_of(name))
}

/// The value of a bound as it is shown.
pub(crate) fn shown(name: &str, value: f64) -> f64 {
    ANGLES.shown(value, TunedBounds::unit_of(name))
}

/// The values of a bound as an axis shows them.
pub(crate) fn all_shown(name: &str, values: &[f64]) -> Vec<f64> {
    values.iter().map(|value| shown(name, *value)).collect()
}

/// The same without its unit: `17.2`.
pub(crate) fn number(name: &str, value: f64) -> String {
    format::exactly(shown(name, value))
}

/// The same with its unit: `17.2°`.
pub(crate) fn in_unit(name: &str, value: f64) -> String {
    with_unit(number(name, value), unit(name))
}

/// What a bound limits, with its unit: `torso lean, °`; empty for any other name.
pub(crate) fn meaning(name: &str) -> String {
    match TunedBounds::quantity_of(name) {
        "" => String::new(),
        quantity => format!("{quantity}, {}", unit(name)),
    }
}

/// A value of another quantity with its unit, an angle in degrees: `0.0123 m`.
pub(crate) fn with_angles_in_degrees(value: f64, unit: &str) -> String {
    with_unit(format::number(ANGLES.shown(value, unit)), ANGLES.of(unit))
}

/// A bound in words: `Torso lean at most 17.2°`.
pub(crate) fn limit_in_words(name: &str, value: f64) -> String {
    let limited = TunedBounds::quantity_of(name);
    let limited = limited.strip_prefix("minimum ").or_else(|| limited.strip_prefix("maximum ")).unwrap_or(limited);
    let is_lower = TunedBounds::place_of(name).is_some_and(|place| TunedBounds::IS_LOWER[place]);
    let mut letters = limited.chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
    let side = if is_lower { "at least" } else { "at most" };
    format!("{first}{} {side} {}", letters.as_str(), in_unit(name, value))
}

/// One bound: name, value, what it limits.
pub(crate) struct Bound {
    pub(crate) name: &'static str,
    pub(crate) value: String,
    pub(crate) meaning: String,
}

/// The bounds of an action.
pub(crate) fn bounds(action: &TunedBounds) -> Vec<Bound> {
    let bound = |(name, value)| Bound { name, value: number(name, value), meaning: meaning(name) };
    TunedBounds::NAMES.into_iter().zip(action.to_array()).map(bound).collect()
}

/// The allowed values of a bound with their unit: `0 to 57.3°`.
pub(crate) fn allowed(name: &str) -> String {
    let (low, high) = TunedBounds::place_of(name).map_or((f64::MIN, f64::MAX), |place| TunedBounds::RANGES[place]);
    with_unit(format!("{} to {}", entry(name, low), entry(name, high)), unit(name))
}

/// Significant digits of an angle in a form.
const DIGITS: i32 = 4;

/// Reads the values of a bound from a field, separated by commas, semicolons or spaces. The error is the refused part.
pub(crate) fn read_list(name: &str, text: &str) -> Result<Vec<f64>, String> {
    let mut text = text.to_owned();
    for unit in [TunedBounds::unit_of(name), unit(name)] {
        text = text.replace(&format!(" {unit}"), unit);
    }
    let parts = text.split([',', ';', ' ']).filter(|part| !part.is_empty());
    parts.map(|part| read(name, part).ok_or_else(|| part.to_owned())).collect()
}

/// Values of a bound in a field, which [`read_list`] reads.
pub(crate) fn list(name: &str, values: &[f64]) -> String {
    values.iter().map(|value| entry(name, *value)).collect::<Vec<_>>().join(", ")
}

/// The value of a bound in a field. [`read`] gives exactly this value again.
pub(crate) fn entry(name: &str, value: f64) -> String {
    if !is_converted(name) {
        return value.to_string();
    }
    let degrees = value.to_degrees();
    let texts = [rounded(degrees, DIGITS).to_string(), degrees.to_string()];
    let exact = texts.into_iter().find(|text| read(name, text) == Some(value));
    exact.unwrap_or_else(|| format!("{value}{}", TunedBounds::unit_of(name)))
}

/// Reads the value of a bound, or a difference between two values, from a field. A number without a unit is in the unit in
/// which the bound is shown. `None` if it is no finite number.
pub(crate) fn read(name: &str, text: &str) -> Option<f64> {
    let text = text.trim();
    let number = |text: &str| text.trim().parse().ok().filter(|value: &f64| value.is_finite());
    let stored = TunedBounds::unit_of(name);
    if !is_converted(name) {
        return number(text.strip_suffix(stored).unwrap_or(text));
    }
    if let Some(text) = text.strip_suffix(stored) {
        return number(text);
    }
    number(text.strip_suffix(unit(name)).unwrap_or(text)).map(to_radians)
}

/// Whether a bound is stored in radians.
fn is_converted(name: &str) -> bool {
    unit(name) != TunedBounds::unit_of(name)
}

/// An angle with few digits means the shortest number of radians that is the same angle to as many digits: 17.19° is 0.3 rad.
/// A form that shows 0.3 rad in degrees thus sends 0.3 rad, and trials with this bound are recognised.
fn to_radians(degrees: f64) -> f64 {
    let exact = degrees.to_radians();
    let is_same = |radians: &f64| rounded(radians.to_degrees(), DIGITS) == degrees;
    (1..=DIGITS + 2).map(|digits| rounded(exact, digits)).find(is_same).unwrap_or(exact)
}

/// The number with so many significant digits.
fn rounded(value: f64, digits: i32) -> f64 {
    if value == 0.0 {
        return value;
    }
    // The parser rounds correctly, unlike a product with a power of ten.
    format!("{value:.*e}", usize::try_from(digits - 1).unwrap_or_default()).parse().unwrap_or(value)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use gaitwright_service::studies::bound_grid::TABLE_I;

    #[test]
    fn bounds_in_words_say_which_side_they_limit_and_have_angles_in_degrees() {
        assert_eq!(limit_in_words("a3", 0.3), "Hip velocity at least 0.3 m/s");
        assert_eq!(limit_in_words("a6", 0.3), "Torso lean at most 17.2°");
        assert_eq!(limit_in_words("a8", 30.0), "Ankle angle at most 30°");
        assert_eq!(
            (meaning("a1").as_str(), meaning("a5").as_str()),
            ("coordinate velocity, °/s", "swing-foot clearance, m")
        );
    }

    #[test]
    fn every_value_comes_back_exactly_from_its_field() {
        for (name, (low, high)) in TunedBounds::NAMES.into_iter().zip(TunedBounds::RANGES) {
            let place = TunedBounds::place_of(name).unwrap();
            let (values, lengthscale) = TABLE_I[place];
            let drawn = (0..1000).map(|step| low + (high - low) * f64::from(step) / 999.0);
            let short =
                values.iter().copied().chain([low, high, lengthscale, TunedBounds::default().to_array()[place]]);
            for value in short.clone().chain(drawn) {
                assert_eq!(read(name, &entry(name, value)), Some(value), "{name} {value}");
            }
            for value in short {
                assert!(entry(name, value).len() <= 5, "{name}: {}", entry(name, value));
            }
        }
    }

    #[test]
    fn field_reads_degrees_and_other_units_if_they_are_named() {
        assert_eq!(["17.19", " 17.19° ", "0.3 rad", "0.3rad"].map(|text| read("a6", text)), [Some(0.3); 4]);
        assert_eq!(["1146", "1146 °/s", "20 rad/s"].map(|text| read("a1", text)), [Some(20.0); 3]);
        assert_eq!(["30", "30°"].map(|text| read("a7", text)), [Some(30.0); 2]);
        assert_eq!(["0.02", "0.02 m"].map(|text| read("a5", text)), [Some(0.02); 2]);
        assert!((read("a6", "15").unwrap() - 15_f64.to_radians()).abs() < 1e-6);
        assert_eq!(read("a6", "15.123456"), Some(15.123_456_f64.to_radians()));
        assert_eq!(["", "high", "NaN", "inf", "3 m"].map(|text| read("a6", text)), [None; 5]);
        assert_eq!(allowed("a6"), "0 to 57.3°");
        assert_eq!(read_list("a6", "0; 5.73 °, 0.2 rad 17.19"), Ok(vec![0.0, 0.1, 0.2, 0.3]));
        assert_eq!(read_list("a6", "0, high"), Err("high".to_owned()));
    }
}
