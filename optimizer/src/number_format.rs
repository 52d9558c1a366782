//! Numbers and their units in messages, on pages and in charts.

use std::fmt::Display;

/// A number with its unit: `0.5 m/s`, `15°`. Only the degree, minute and second of plane angle follow without a space (SI
/// Brochure, 5.4.3).
pub fn with_unit(number: impl Display, unit: &str) -> String {
    match unit {
        "" | "°" | "′" | "″" => format!("{number}{unit}"),
        _ => format!("{number} {unit}"),
    }
}

/// A decimal number with narrow no-break spaces between groups of three digits, if its whole part has five or more digits:
/// `9999`, `11 664`, `-12 345.5` (SI Brochure, 5.4.4).
pub fn grouped(number: &str) -> String {
    let start = number.find(|c: char| c.is_ascii_digit()).unwrap_or(number.len());
    let (sign, digits) = number.split_at(start);
    let whole = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
    let (whole, rest) = digits.split_at(whole);
    if whole.len() < 5 {
        return number.to_owned();
    }
    let mut text = sign.to_owned();
    for (place, digit) in whole.chars().enumerate() {
        if place > 0 && (whole.len() - place).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text + rest
}

/// The number with three significant digits, or as a whole number from 1000.
pub fn three_digits(value: f64) -> f64 {
    let whole = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    let last = 10_f64.powf(2.0 - whole.min(2.0));
    (value * last).round() / last
}

/// Three significant digits, with an exponent if there would be many zeros.
pub(crate) fn figure(value: f64) -> String {
    let magnitude = value.abs();
    if value != 0.0 && !(1e-3..1e4).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    let last = if value == 0.0 { 1.0 } else { 10_f64.powf(2.0 - magnitude.log10().floor()) };
    format!("{}", (value * last).round() / last)
}

/// Every digit that the number needs, with an exponent if there would be many zeros.
pub(crate) fn shortest(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-4 { format!("{value:e}") } else { value.to_string() }
}

/// The number without the last digits of double precision, which are noise in a sum of decimal fractions.
pub(crate) fn without_noise(value: f64) -> String {
    shortest(format!("{value:.11e}").parse().unwrap_or(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_or_more_digits_are_grouped() {
        let texts = ["7", "9999", "11664", "1000000", "-12345.25", "1e12345", "–"].map(grouped);
        let expected = ["7", "9999", "11\u{202f}664", "1\u{202f}000\u{202f}000", "-12\u{202f}345.25", "1e12345", "–"];
        assert_eq!(texts, expected.map(str::to_owned));
    }

    #[test]
    fn space_separates_every_unit_except_those_of_plane_angle() {
        let texts =
            [with_unit(0.5, "m/s"), with_unit(15, "°"), with_unit(20, "°/s"), with_unit(7, "%"), with_unit(3, "")];
        assert_eq!(texts, ["0.5 m/s", "15°", "20 °/s", "7 %", "3"].map(str::to_owned));
    }
}
