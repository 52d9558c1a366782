//! Numbers formatted for messages.

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
