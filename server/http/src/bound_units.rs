//! Bounds as pages and charts show them: angles in degrees. REST, files and the command line have radians.

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

/// The value of a bound as text without its unit: `17.2`.
pub(crate) fn number(name: &str, value: f64) -> String {
    format::exactly(shown(name, value))
}

/// The value of a bound as text with its unit: `17.2°`.
pub(crate) fn in_unit(name: &str, value: f64) -> String {
    with_unit(number(name, value), unit(name))
}

/// Limited quantity of a bound, with its unit: `torso lean, °`; empty for any other name.
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
