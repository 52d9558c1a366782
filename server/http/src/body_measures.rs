//! Height and body mass as people type them, in metres and kilograms or in feet, inches and pounds.

use gait_optimizer::number_format::three_digits;
use gaitwright_service::error::Error;
use std::str::FromStr;

const METRES_PER_INCH: f64 = 0.0254;
const KILOGRAMS_PER_POUND: f64 = 0.453_592_37;

/// Reads a height: `1.73`, `1.73 m`, `173 cm`, `5 ft 8 in`, `5'8"`; m, to the millimetre.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(crate) fn height_m(field: &str, text: &str) -> Result<f64, Error> {
    read_height(text).map(|height| round(height, 1000.0)).ok_or_else(|| {
        Error::invalid(field, text, "a number in metres, such as 1.75, or feet and inches, such as 5 ft 9 in")
    })
}

/// Reads a body mass: `65.7`, `65.7 kg`, `145 lb`; kg, to 10 g.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(crate) fn mass_kg(field: &str, text: &str) -> Result<f64, Error> {
    read_mass(text)
        .map(|mass| round(mass, 100.0))
        .ok_or_else(|| Error::invalid(field, text, "a number in kilograms, such as 65.7, or in pounds, such as 145 lb"))
}

/// `5 ft 8 in`, to the inch.
pub(crate) fn feet_and_inches(height_m: f64) -> String {
    let inches = (height_m / METRES_PER_INCH).round();
    format!("{} ft {} in", (inches / 12.0).floor(), inches % 12.0)
}

/// `145 lb`, to the pound.
pub(crate) fn pounds(mass_kg: f64) -> String {
    format!("{:.0} lb", mass_kg / KILOGRAMS_PER_POUND)
}

/// A height that was probably meant by a number of another unit, m.
pub(crate) fn likely_height_m(number: f64) -> Option<f64> {
    likely(number, (1.4, 2.2), [1.0, 0.01, 0.001, METRES_PER_INCH, 12.0 * METRES_PER_INCH])
}

/// A body mass that was probably meant by a number of another unit, kg.
pub(crate) fn likely_mass_kg(number: f64) -> Option<f64> {
    likely(number, (35.0, 160.0), [1.0, KILOGRAMS_PER_POUND, 0.001])
}

/// The number in the only unit in which it is within the range, with three significant digits or as a whole number. `None` also if it is within
/// the range in several units, because then nobody can know what was meant.
pub(crate) fn likely<const N: usize>(number: f64, (low, high): (f64, f64), units: [f64; N]) -> Option<f64> {
    let mut fitting = units.into_iter().map(|unit| number * unit).filter(|value| (low..=high).contains(value));
    let (Some(found), None) = (fitting.next(), fitting.next()) else { return None };
    Some(three_digits(found)).filter(|value| (low..=high).contains(value))
}

/// Rounds values of other units only: a number as typed has its digits already.
fn round((value, is_as_typed): (f64, bool), per_unit: f64) -> f64 {
    if is_as_typed { value } else { (value * per_unit).round() / per_unit }
}

/// The height, m, and whether it was typed as a number of metres.
fn read_height(text: &str) -> Option<(f64, bool)> {
    let text = text.trim().to_lowercase();
    if let Some(feet) = parts(&text, &["ft", "feet", "foot", "'", "\u{2032}"]) {
        let (feet, rest) = feet;
        let inches = match rest {
            "" => 0.0,
            rest => number(suffixed(rest, &["inches", "in", "\"", "\u{2033}"]).unwrap_or(rest))?,
        };
        let feet: f64 = number(feet)?;
        return ((0.0..12.0).contains(&inches) && feet.fract() == 0.0)
            .then_some(((12.0 * feet + inches) * METRES_PER_INCH, false));
    }
    if let Some(inches) = suffixed(&text, &["inches", "in", "\"", "\u{2033}"]) {
        return Some((number(inches)? * METRES_PER_INCH, false));
    }
    if let Some(centimetres) = suffixed(&text, &["cm"]) {
        return Some((number(centimetres)? / 100.0, false));
    }
    Some((number(suffixed(&text, &["m"]).unwrap_or(&text))?, true))
}

/// The body mass, kg, and whether it was typed as a number of kilograms.
fn read_mass(text: &str) -> Option<(f64, bool)> {
    let text = text.trim().to_lowercase();
    if let Some(pounds) = suffixed(&text, &["pounds", "lbs", "lb"]) {
        return Some((number(pounds)? * KILOGRAMS_PER_POUND, false));
    }
    Some((number(suffixed(&text, &["kg"]).unwrap_or(&text))?, true))
}

/// The parts before and after the first of these units that occurs.
fn parts<'a>(text: &'a str, units: &[&str]) -> Option<(&'a str, &'a str)> {
    let (before, after) = units.iter().find_map(|unit| text.split_once(unit))?;
    Some((before.trim(), after.trim()))
}

/// The text before one of these units at its end.
fn suffixed<'a>(text: &'a str, units: &[&str]) -> Option<&'a str> {
    units.iter().find_map(|unit| text.strip_suffix(unit)).map(str::trim)
}

fn number(text: &str) -> Option<f64> {
    f64::from_str(text).ok().filter(|number| number.is_finite())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn height_is_read_in_metres_centimetres_feet_and_inches() {
        for (text, expected) in [
            ("1.7272", 1.7272),
            (" 1.73 m", 1.73),
            ("173 cm", 1.73),
            ("5 ft 8 in", 1.727),
            ("5'8\"", 1.727),
            ("5\u{2032}8\u{2033}", 1.727),
            ("6 FT", 1.829),
            ("68 in", 1.727),
        ] {
            assert_eq!(height_m("height_m", text).unwrap(), expected, "{text}");
        }
        for text in ["", "tall", "1,73", "5 ft 13 in", "5.5 ft 2 in", "NaN", "1.73 kg", "'"] {
            assert!(matches!(height_m("height_m", text), Err(Error::Invalid(_))), "{text}");
        }
    }

    #[test]
    fn mass_is_read_in_kilograms_and_pounds() {
        for (text, expected) in [("65.7", 65.7), ("65.7 kg", 65.7), ("145 lb", 65.77), ("145lbs", 65.77)] {
            assert_eq!(mass_kg("body_mass_kg", text).unwrap(), expected, "{text}");
        }
        for text in ["", "65,7", "heavy", "65 m", "inf"] {
            assert!(matches!(mass_kg("body_mass_kg", text), Err(Error::Invalid(_))), "{text}");
        }
    }

    #[test]
    fn number_in_another_unit_is_recognised() {
        assert_eq!([173.0, 1730.0, 68.0, 5.7].map(likely_height_m), [Some(1.73), Some(1.73), Some(1.73), Some(1.74)]);
        assert_eq!([0.2, 3.0, 30.0, 300.0].map(likely_height_m), [None; 4]);
        assert_eq!([200.0, 65700.0, 10.0].map(likely_mass_kg), [Some(90.7), Some(65.7), None]);
    }

    #[test]
    fn customary_units_are_rounded() {
        assert_eq!((feet_and_inches(1.727), pounds(65.7)), ("5 ft 8 in".to_owned(), "145 lb".to_owned()));
        assert_eq!(feet_and_inches(1.83), "6 ft 0 in");
    }
}
